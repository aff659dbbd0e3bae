// Particles or pins as balls. One instance: a ball of a cloth; `first_cloth` is the only cloth.
#include "draw/cloths.glsl"
#include "draw/constraints.glsl"
#include "draw/disc.glsl"
#include "draw/frame.glsl"
#include "draw/shaded.glsl"

layout(location = DRAPE_DRAW_UNIFORM_BALL_KIND) uniform uint ball_kind;

layout(location = 0) out vec3 position;
layout(location = 1) out vec3 right;
layout(location = 2) out vec3 up;
layout(location = 3) out vec2 disc;
layout(location = 4) flat out float value;
layout(location = 5) flat out vec3 colour;
out float gl_ClipDistance[1];

void main() {
  DrawRecord cloth = cloths[first_cloth];
  bool is_pin = ball_kind == DRAPE_DRAW_BALL_PINS;
  uint particle = uint(gl_InstanceID);
  if (is_pin) particle = constraint_words[cloth.pins + particle];
  vec3 p = LocalPosition(cloth.positions, particle);
  bool is_finite = IsFinite(p);
  gl_ClipDistance[0] = is_finite ? 1.0 : -1.0;
  vec3 center = (is_finite ? p : vec3(0.0)) + cloth.offset.xyz;
  vec3 to_viewer = ToViewer(center);
  DiscAxes(to_viewer, right, up);
  disc = DiscCorner(gl_VertexID);
  float radius = is_pin ? max(cloth.pin_radius, 3.0 * HalfPixel(center))
                        : max(cloth.ball_radius, HalfPixel(center));
  // Before the lines that end in it and the cloth that hangs from it.
  position = center + radius * (disc.x * right + disc.y * up + to_viewer);
  value = shaded[cloth.shaded + particle].w;
  colour = is_pin ? vec3(0.62, 0.035, 0.03) : cloth.colour.rgb;
  gl_Position = frame.clip_from_world * vec4(position, 1.0);
}
