// A gradient from the bottom to the top.
layout(location = 0) in float height;
layout(location = 0) out vec4 picture;

void main() {
  const vec3 bottom = vec3(0.58, 0.63, 0.69);
  const vec3 top = vec3(0.90, 0.925, 0.95);
  picture = vec4(mix(bottom, top, smoothstep(0.0, 0.9, height)), 1.0);
}
