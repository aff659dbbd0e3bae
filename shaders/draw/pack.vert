// One triangle over a tile; its top row first.
layout(location = 0) out float height;  // above the lower edge, as a share of the picture's height

void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  height = 0.5 - 0.5 * corner.y;
  gl_Position = vec4(corner, 0.0, 1.0);
}
