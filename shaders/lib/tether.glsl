// Stage `tether`: no particle farther from a pin than the cloth between them is long
// (server/solver/README.md, step 2).
#ifndef DRAPE_LIB_TETHER_GLSL_
#define DRAPE_LIB_TETHER_GLSL_

#include "lib/vector.glsl"

// u of the particle, for d [m] from the pin to it as predicted at the end of the substep: where |d| is
// beyond `reach` [m] the excess is taken off within h. Bender et al. 2009, section 3.2, for the
// inequality reach - |d| >= 0 and a pin of inverse mass 0. u [m/s], inverse_h [1/s].
vec3 TetheredVelocity(vec3 u, vec3 d, float reach, float inverse_h) {
  float length_d = Length(d);
  if (length_d <= reach) return u;
  precise float speed = (length_d - reach) * inverse_h;
  precise float speed_per_length = speed / length_d;
  return AddScaled(u, -speed_per_length, d);
}

#endif
