// A light floor with a fine grid; seen from below it is transparent.
#include "draw/light.glsl"

layout(std430, binding = DRAPE_DRAW_BINDING_INSTANCES) readonly buffer Planes {
  PlaneRecord planes[];
};

layout(location = 0) in vec3 position;
layout(location = 1) in vec2 from_center;
layout(location = 2) flat in uint plane_index;
layout(location = 0) out vec4 picture;

// The share of the pixel that a grid of lines, `width` [px] wide, covers; 0 where the lines are too dense to be
// seen one by one.
float GridLines(vec2 place, float distance_m, float width) {
  vec2 cell = place / distance_m;
  vec2 pixel = fwidth(cell);
  vec2 line = clamp(0.5 + 0.5 * width - abs(fract(cell - 0.5) - 0.5) / pixel, 0.0, 1.0);
  vec2 is_clear = clamp(1.5 - 6.0 * pixel, 0.0, 1.0);
  return max(line.x * is_clear.x, line.y * is_clear.y);
}

void main() {
  PlaneRecord plane = planes[plane_index];
  vec3 normal = cross(plane.tangent.xyz, plane.bitangent.xyz);
  bool is_above = dot(normal, ToViewer(position)) > 0.0;
  vec2 place = from_center + vec2(plane.tangent.w, plane.bitangent.w);
  float lines = max(0.3 * GridLines(place, plane.grid.x, 1.4),
                    0.1 * GridLines(place, 0.1 * plane.grid.x, 1.0));
  vec3 base = mix(vec3(0.80, 0.815, 0.835), vec3(0.25, 0.28, 0.33), lines);
  float faded = clamp(length(from_center) / plane.center.w, 0.0, 1.0);
  if (faded == 1.0) discard;
  float alpha = (is_above ? 1.0 : 0.25) * (1.0 - smoothstep(0.25, 1.0, faded));
  picture = vec4(ShadedColour(base, position, is_above ? normal : -normal, 0.0), alpha);
}
