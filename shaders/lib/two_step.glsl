// Stage `predict` with two steps: the backward differentiation formula of second order
// (server/solver/method.md, "Substeps").
#ifndef DRAPE_LIB_TWO_STEP_GLSL_
#define DRAPE_LIB_TWO_STEP_GLSL_

// x + (x - x')/3, for positions [m] or velocities [m/s] and the previous ones.
vec3 Extrapolated(vec3 x, vec3 previous) {
  precise vec3 ahead = (x - previous) * (1.0 / 3.0);
  precise vec3 sum = x + ahead;
  return sum;
}

#endif
