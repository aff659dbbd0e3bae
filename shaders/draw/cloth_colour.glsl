// The colour of a place on a cloth, lit from both sides; its back is a little darker and paler.
#include "draw/light.glsl"
#include "draw/value_colour.glsl"

// `normal`: the smooth one of the front, not of unit length; `value`, `colour`: of the cloth there.
vec3 ClothColour(vec3 position, vec3 normal, bool is_front, float value, vec3 colour) {
  vec3 base = BaseColour(value, colour);
  vec3 n = normal;
  if (!is_front) {
    n = -n;
    if (colouring == DRAPE_DRAW_NO_VALUE) {
      base = 0.72 * mix(base, vec3(dot(base, vec3(0.2126, 0.7152, 0.0722))), 0.35);
    }
  }
  float size = length(n);
  n = size > 1e-3 ? n / size : ToViewer(position);
  float gloss = colouring == DRAPE_DRAW_NO_VALUE ? 0.06 : 0.0;
  return ShadedColour(base, position, n, gloss);
}
