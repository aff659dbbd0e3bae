// Vector arithmetic with a fixed order of operations: `precise` keeps drivers from fusing or reordering,
// so that results match the CPU backends closely and never depend on how a call was inlined.
#ifndef DRAPE_LIB_VECTOR_GLSL_
#define DRAPE_LIB_VECTOR_GLSL_

#include "lib/roots.glsl"

float Dot(vec3 a, vec3 b) {
  precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
  return sum;
}

float Length(vec3 a) {
  return Root(Dot(a, a));
}

// How large the components are: what is computed from them is rounded in proportion.
float SumOfSizes(vec3 v) {
  precise float sum = (abs(v.x) + abs(v.y)) + abs(v.z);
  return sum;
}

// a + s b
vec3 AddScaled(vec3 a, float s, vec3 b) {
  precise vec3 scaled = s * b;
  precise vec3 sum = a + scaled;
  return sum;
}

// d / length; `fallback` if d is too short to have a direction. [m]
vec3 Direction(vec3 d, float length_d, vec3 fallback) {
  if (length_d < MIN_DIRECTION_LENGTH) return fallback;
  precise vec3 unit = Reciprocal(length_d) * d;
  return unit;
}

vec3 Cross(vec3 a, vec3 b) {
  precise vec3 cross_product =
      vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  return cross_product;
}

#endif
