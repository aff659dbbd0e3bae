// The colour of a value on the scale of the picture.
#include "draw/frame.glsl"
#include "lib/colour_map.glsl"

layout(location = DRAPE_DRAW_UNIFORM_COLOURING) uniform uint colouring;

// `colour` if there are no values.
vec3 BaseColour(float value, vec3 colour) {
  float t = (value - frame.scale.x) * frame.scale.y;
  if (colouring == DRAPE_DRAW_STRAIN) return 0.92 * StrainColour(t);
  if (colouring == DRAPE_DRAW_SIZE) return SpeedColour(t);
  return colour;
}
