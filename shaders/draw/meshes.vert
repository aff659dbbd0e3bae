// A mesh collider. One vertex: a corner of a triangle; the record gives the place of the mesh.
#include "draw/frame.glsl"

layout(std430, binding = DRAPE_DRAW_BINDING_SURFACE) readonly buffer Corners {
  float corners[];  // [][DRAPE_DRAW_MESH_CORNER_WORDS]
};
layout(std430, binding = DRAPE_DRAW_BINDING_INSTANCES) readonly buffer Meshes {
  SolidRecord meshes[];
};
layout(location = DRAPE_DRAW_UNIFORM_MESH) uniform uint mesh_index;

layout(location = 0) out vec3 position;
layout(location = 1) out vec3 normal;
layout(location = 2) flat out vec3 colour;

void main() {
  uint word = DRAPE_DRAW_MESH_CORNER_WORDS * uint(gl_VertexID);
  vec3 local_position = vec3(corners[word], corners[word + 1u], corners[word + 2u]);
  vec3 local_normal = vec3(corners[word + 3u], corners[word + 4u], corners[word + 5u]);
  SolidRecord mesh = meshes[mesh_index];
  mat3 axes = mat3(mesh.axis_x.xyz, mesh.axis_y.xyz, mesh.axis_z.xyz);
  normal = axes * local_normal;
  position = mesh.center.xyz + axes * local_position;
  colour = mesh.colour.rgb;
  gl_Position = frame.clip_from_world * vec4(position, 1.0);
}
