// Stage `apply_springs`: explicit spring-dampers (bending and shear, Bender et al. 2009, section 4.1).
#ifndef DRAPE_LIB_SPRING_GLSL_
#define DRAPE_LIB_SPRING_GLSL_

#include "lib/vector.glsl"

// Force on i [N]: (k (|d| - l0) + c (v_j - v_i).n) n with d = p_j - p_i, n = d/|d|; none where d has no
// direction. k [N/m], c [N s/m].
vec3 SpringForce(vec3 position_difference, vec3 velocity_difference, float rest_length,
                 float stiffness, float damping) {
  float length_d = Length(position_difference);
  if (length_d < MIN_DIRECTION_LENGTH) return vec3(0.0);
  vec3 n = Direction(position_difference, length_d, vec3(0.0));
  precise float elastic = stiffness * (length_d - rest_length);
  precise float viscous = damping * Dot(velocity_difference, n);
  precise float force = elastic + viscous;
  precise vec3 force_vector = force * n;
  return force_vector;
}

#endif
