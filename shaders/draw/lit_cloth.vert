// The surface of a cloth that is lit at its particles (light_particles). One vertex: a particle; one instance: a cloth.
#define LIT_ACCESS readonly
#include "draw/cloths.glsl"
#include "draw/frame.glsl"
#include "draw/lit.glsl"

layout(location = 0) out vec3 front;
layout(location = 1) out vec3 back;
out float gl_ClipDistance[1];

void main() {
  uint index = first_cloth + uint(gl_InstanceID);
  uint particle = uint(gl_VertexID);
  vec3 p = LocalPosition(cloths[index].positions, particle);
  bool is_finite = IsFinite(p);
  gl_ClipDistance[0] = is_finite ? 1.0 : -1e6;
  uint word = DRAPE_DRAW_LIT_WORDS * (cloths[index].shaded + particle);
  vec2 middle = unpackUnorm2x16(lit[word + 1u]);
  front = vec3(unpackUnorm2x16(lit[word]), middle.x);
  back = vec3(middle.y, unpackUnorm2x16(lit[word + 2u]));
  vec3 position = (is_finite ? p : vec3(0.0)) + cloths[index].offset.xyz;
  gl_Position = frame.clip_from_world * vec4(position, 1.0);
}
