// Small balls are discs that turn to the viewer; the fragment shader makes them look round.

// Vertex `index` of DRAPE_DRAW_DISC_VERTICES, a fan of triangles, in the unit circle.
vec2 DiscCorner(int index) {
  int triangle = index / 3;
  int corner = index % 3 == 0 ? 0 : triangle + index % 3;
  float angle = 6.2831853 * float(corner) / float(DRAPE_DRAW_DISC_CORNERS);
  return vec2(cos(angle), sin(angle));
}

// Two unit vectors across the direction to the viewer.
void DiscAxes(vec3 to_viewer, out vec3 right, out vec3 up) {
  vec3 beside = abs(to_viewer.y) < 0.9 ? vec3(0, 1, 0) : vec3(1, 0, 0);
  right = normalize(cross(beside, to_viewer));
  up = cross(to_viewer, right);
}
