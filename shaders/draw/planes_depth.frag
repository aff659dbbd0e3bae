// Only the depth of a floor, as far as it is drawn.
#include "interface/draw_bindings.h"
#include "interface/draw_records.h"

layout(std430, binding = DRAPE_DRAW_BINDING_INSTANCES) readonly buffer Planes {
  PlaneRecord planes[];
};

layout(location = 1) in vec2 from_center;
layout(location = 2) flat in uint plane_index;

void main() {
  if (length(from_center) >= planes[plane_index].center.w) discard;
}
