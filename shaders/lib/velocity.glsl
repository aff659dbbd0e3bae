// Stage `solve_velocity`: velocity constraints of rigid links.
#ifndef DRAPE_LIB_VELOCITY_GLSL_
#define DRAPE_LIB_VELOCITY_GLSL_

// Delta Lambda = -n . (v_j - v_i) / (w_i + w_j) [N s], no 1/h. Bender et al. 2009, section 3.2.
float VelocityImpulse(float speed, float inverse_mass_i, float inverse_mass_j) {
  precise float inverse_mass_sum = inverse_mass_i + inverse_mass_j;
  precise float impulse = -speed / inverse_mass_sum;
  return impulse;
}

#endif
