// Sphere colliders, as a grid of 2 * segments by segments faces. One instance: a sphere.
#include "draw/frame.glsl"

layout(std430, binding = DRAPE_DRAW_BINDING_INSTANCES) readonly buffer Balls { BallRecord balls[]; };
layout(location = DRAPE_DRAW_UNIFORM_SEGMENTS) uniform uint segments;

layout(location = 0) out vec3 position;
layout(location = 1) out vec3 normal;
layout(location = 2) flat out vec3 colour;

const uvec2 kCorners[6] =
    uvec2[](uvec2(0, 0), uvec2(0, 1), uvec2(1, 1), uvec2(0, 0), uvec2(1, 1), uvec2(1, 0));

void main() {
  uint face = uint(gl_VertexID) / 6u;
  uvec2 corner = uvec2(face % (2u * segments), face / (2u * segments)) + kCorners[gl_VertexID % 6];
  float around = 3.14159265 * float(corner.x) / float(segments);
  float down = 3.14159265 * float(corner.y) / float(segments);
  normal = vec3(sin(down) * sin(around), cos(down), sin(down) * cos(around));
  BallRecord ball = balls[gl_InstanceID];
  position = ball.center.xyz + ball.center.w * normal;
  colour = ball.colour.rgb;
  gl_Position = frame.clip_from_world * vec4(position, 1.0);
}
