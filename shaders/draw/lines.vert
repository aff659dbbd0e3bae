// Distance constraints as ribbons that turn to the viewer and look round. Six vertices: a
// constraint; one instance: a cloth.
#include "draw/cloths.glsl"
#include "draw/constraints.glsl"
#include "draw/frame.glsl"
#include "draw/shaded.glsl"

layout(std430, binding = DRAPE_DRAW_BINDING_INSTANCES) readonly buffer Groups {
  vec4 group_colours[];
};
layout(location = DRAPE_DRAW_UNIFORM_COLOURING) uniform uint colouring;

layout(location = 0) out vec3 position;
layout(location = 1) out vec3 side;
layout(location = 2) out float across;
layout(location = 3) out float value;
layout(location = 4) flat out vec3 colour;
out float gl_ClipDistance[1];

// Along (0 or 1) and across (-1 or 1) of the two triangles of a ribbon.
const vec2 kCorners[6] = vec2[](vec2(0, -1), vec2(1, -1), vec2(1, 1), vec2(0, -1), vec2(1, 1), vec2(0, 1));

// At least about a pixel wide, but never wider than the constraint's length.
float LineRadius(float radius, vec3 place, float span) {
  return min(max(radius, 1.2 * HalfPixel(place)), max(radius, 0.2 * span));
}

void main() {
  DrawRecord cloth = cloths[first_cloth + uint(gl_InstanceID)];
  uint word = cloth.constraints + DRAPE_DRAW_CONSTRAINT_WORDS * uint(gl_VertexID / 6);
  uint i = constraint_words[word];
  uint j = constraint_words[word + 1u];
  uint group = constraint_words[word + 2u];
  vec2 corner = kCorners[gl_VertexID % 6];
  vec3 start = LocalPosition(cloth.positions, i);
  vec3 end = LocalPosition(cloth.positions, j);
  bool is_finite = IsFinite(start) && IsFinite(end);
  gl_ClipDistance[0] = is_finite ? 1.0 : -1.0;
  if (!is_finite) start = end = vec3(0.0);

  vec3 place = mix(start, end, corner.x) + cloth.offset.xyz;
  vec3 to_viewer = ToViewer(place);
  vec3 turned = cross(end - start, to_viewer);
  float size = length(turned);
  side = size > 0.0 ? turned / size : vec3(0.0);
  across = corner.y;
  float radius = LineRadius(cloth.line_radius, place, distance(start, end));
  // Lines on a surface are drawn on the side that the viewer sees.
  float lift = cloth.has_surface != 0u ? 1.5 * radius : 0.0;
  position = place + radius * corner.y * side + lift * to_viewer;
  value = shaded[cloth.shaded + (corner.x == 0.0 ? i : j)].w;
  colour = colouring == DRAPE_DRAW_GROUPS ? group_colours[group].rgb : cloth.colour.rgb;
  gl_Position = frame.clip_from_world * vec4(position, 1.0);
}
