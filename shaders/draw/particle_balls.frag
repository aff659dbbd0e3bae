// Discs, lit as if they were balls.
#include "draw/picture.glsl"
#include "draw/value_colour.glsl"
#include "lib/shading.glsl"

layout(location = DRAPE_DRAW_UNIFORM_BALL_KIND) uniform uint ball_kind;

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 right;
layout(location = 2) in vec3 up;
layout(location = 3) in vec2 disc;
layout(location = 4) flat in float value;
layout(location = 5) flat in vec3 colour;
layout(location = 0) out vec4 picture;

void main() {
  float toward = sqrt(max(1.0 - dot(disc, disc), 0.0));
  vec3 n = normalize(disc.x * right + disc.y * up + toward * ToViewer(position));
  vec3 base = ball_kind == DRAPE_DRAW_BALL_PINS ? colour : BaseColour(value, colour);
  // Always in the light: seen from the light the disc is another one, which would shade this one.
  vec3 to_light = frame.to_light.xyz;
  picture = Opaque(LitColour(base, n, ToViewer(position), to_light, 1.0, 0.15));
}
