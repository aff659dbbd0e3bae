// The uniform block of a pass.
#include "interface/draw_bindings.h"
#include "interface/draw_records.h"

layout(std140, binding = DRAPE_DRAW_BINDING_FRAME) uniform Frame { DrawFrame frame; };

// Unit vector from a place to the viewer, which may be infinitely far away (the key light is).
vec3 ToViewer(vec3 position) {
  return normalize(frame.viewer.xyz - frame.viewer.w * position);
}

// Half the width of a pixel there [m].
float HalfPixel(vec3 position) {
  return 0.5 * frame.screen.z * mix(1.0, length(position), frame.viewer.w);
}
