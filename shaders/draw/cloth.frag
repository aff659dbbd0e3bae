// Cloth, lit from both sides; its back is a little darker and paler.
#include "draw/light.glsl"
#include "draw/value_colour.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float value;
layout(location = 3) flat in vec3 colour;
layout(location = 0) out vec4 picture;

void main() {
  vec3 base = BaseColour(value, colour);
  vec3 n = normal;
  if (!gl_FrontFacing) {
    n = -n;
    if (colouring == DRAPE_DRAW_NO_VALUE) {
      base = 0.72 * mix(base, vec3(dot(base, vec3(0.2126, 0.7152, 0.0722))), 0.35);
    }
  }
  float size = length(n);
  n = size > 1e-3 ? n / size : ToViewer(position);
  float gloss = colouring == DRAPE_DRAW_NO_VALUE ? 0.06 : 0.0;
  picture = vec4(ShadedColour(base, position, n, gloss), 1.0);
}
