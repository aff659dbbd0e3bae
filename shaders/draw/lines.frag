// Ribbons, lit as if they were round. Colours of groups are shown as they are in the legend.
#include "draw/light.glsl"
#include "draw/picture.glsl"
#include "draw/value_colour.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 side;
layout(location = 2) in float across;
layout(location = 3) in float value;
layout(location = 4) flat in vec3 colour;
layout(location = 0) out vec4 picture;

void main() {
  if (colouring == DRAPE_DRAW_GROUPS) {
    picture = Opaque(colour);
    return;
  }
  float up = sqrt(max(1.0 - across * across, 0.0));
  vec3 n = normalize(across * side + up * ToViewer(position));
  picture = Opaque(ShadedColour(BaseColour(value, colour), position, n, 0.05));
}
