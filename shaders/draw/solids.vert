// Solid colliders: all points no farther than a radius from a box, which is a sphere if the box is a point, a
// capsule if it is a segment, a cuboid if the radius is 0. One instance: a solid. The eighths of a sphere,
// `quarter` by `quarter` faces each, are moved to the corners of the box. The faces between them come
// from twin rows and columns of vertices, and a row of faces at each pole.
#include "draw/frame.glsl"

layout(std430, binding = DRAPE_DRAW_BINDING_INSTANCES) readonly buffer Solids {
  SolidRecord solids[];
};
layout(location = DRAPE_DRAW_UNIFORM_FIRST_INSTANCE) uniform uint first_instance;
layout(location = DRAPE_DRAW_UNIFORM_QUARTER_FACES) uniform uint quarter;

layout(location = 0) out vec3 position;
layout(location = 1) out vec3 normal;
layout(location = 2) flat out vec3 colour;

const float kQuarter = 1.57079633;

void main() {
  uint columns = 4u * (quarter + 1u);
  uint rows = 2u * quarter + 3u;
  uint column = uint(gl_VertexID) % columns;
  uint row = uint(gl_VertexID) / columns;
  uint around_eighth = column / (quarter + 1u);
  float around =
      kQuarter * (float(around_eighth) + float(column % (quarter + 1u)) / float(quarter));
  float middle = kQuarter * (float(around_eighth) + 0.5);
  // Rows: a pole, quarter + 1 of the upper half, as many of the lower one, a pole.
  bool is_upper = row <= quarter + 1u;
  uint step_down = is_upper ? max(row, 1u) - 1u : min(row, rows - 1u) - 2u;
  float down = kQuarter * float(step_down) / float(quarter);
  bool is_pole = row == 0u || row == rows;

  vec3 local_normal = vec3(sin(down) * sin(around), cos(down), sin(down) * cos(around));
  vec3 side = vec3(is_pole ? 0.0 : sign(sin(middle)), is_upper ? 1.0 : -1.0,
                   is_pole ? 0.0 : sign(cos(middle)));
  SolidRecord solid = solids[first_instance + uint(gl_InstanceID)];
  mat3 axes = mat3(solid.axis_x.xyz, solid.axis_y.xyz, solid.axis_z.xyz);
  vec3 half_extents = vec3(solid.axis_x.w, solid.axis_y.w, solid.axis_z.w);
  normal = axes * local_normal;
  position = solid.center.xyz + axes * (side * half_extents) + solid.center.w * normal;
  colour = solid.colour.rgb;
  gl_Position = frame.clip_from_world * vec4(position, 1.0);
}
