// Stage `solve_joints`: the impulse of one point joint.
#ifndef DRAPE_LIB_JOINT_GLSL_
#define DRAPE_LIB_JOINT_GLSL_

// r = C + (alpha/h) Lambda [m] along all axes, with C = p_j - p_i. [m/N], [1/s], [N s].
vec3 JointResidual(vec3 difference, float compliance, float inverse_h, vec3 lambda) {
#ifdef HAS_JOINT_COMPLIANCE
  precise vec3 residual = difference + compliance * inverse_h * lambda;
  return residual;
#else
  return difference;
#endif
}

// Delta Lambda = -r / h / (w_i + w_j + alpha/h^2) [N s]: an equality constraint along each axis, Bender et
// al. 2009, section 3.2.
vec3 JointImpulse(vec3 residual, float inverse_h, float inverse_mass_sum, float compliance) {
#ifdef HAS_JOINT_COMPLIANCE
  precise float denominator = inverse_mass_sum + compliance * inverse_h * inverse_h;
#else
  precise float denominator = inverse_mass_sum;
#endif
  precise vec3 impulse = -(residual * inverse_h) / denominator;
  return impulse;
}

#endif
