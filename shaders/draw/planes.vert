// Plane colliders, as discs that fade out. One instance: a plane; three vertices: the triangle around
// the disc. Without an edge inside the disc, along which llvmpipe's derivatives are wrong.
#include "draw/frame.glsl"

layout(std430, binding = DRAPE_DRAW_BINDING_INSTANCES) readonly buffer Planes {
  PlaneRecord planes[];
};
layout(location = DRAPE_DRAW_UNIFORM_FIRST_INSTANCE) uniform uint first_instance;

layout(location = 0) out vec3 position;
layout(location = 1) out vec2 from_center;
layout(location = 2) flat out uint plane_index;

// Around the unit circle.
const vec2 kCorners[3] = vec2[](vec2(-1.7320508, -1), vec2(1.7320508, -1), vec2(0, 2));

void main() {
  plane_index = first_instance + uint(gl_InstanceID);
  PlaneRecord plane = planes[plane_index];
  from_center = plane.center.w * kCorners[gl_VertexID];
  position = plane.center.xyz + from_center.x * plane.tangent.xyz +
             from_center.y * plane.bitangent.xyz;
  gl_Position = frame.clip_from_world * vec4(position, 1.0);
}
