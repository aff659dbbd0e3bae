// The surface of a cloth. One vertex: a particle, fetched from the solver's memory; one instance: a cloth.
#include "draw/cloths.glsl"
#include "draw/frame.glsl"
#include "draw/shaded.glsl"

layout(location = 0) out vec3 position;
layout(location = 1) out vec3 normal;
layout(location = 2) out float value;
layout(location = 3) flat out vec3 colour;
out float gl_ClipDistance[1];

void main() {
  uint index = first_cloth + uint(gl_InstanceID);
  uint particle = uint(gl_VertexID);
  vec3 p = LocalPosition(cloths[index].positions, particle);
  vec4 shade = shaded[cloths[index].shaded + particle];
  // A particle that is not finite removes its triangles: they end at their other corners.
  bool is_finite = IsFinite(p);
  gl_ClipDistance[0] = is_finite ? 1.0 : -1e6;
  position = (is_finite ? p : vec3(0.0)) + cloths[index].offset.xyz;
  normal = shade.xyz;
  value = shade.w;
  colour = cloths[index].colour.rgb;
  gl_Position = frame.clip_from_world * vec4(position, 1.0);
}
