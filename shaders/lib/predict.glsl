// Stage `predict`: the mean velocity over a substep (server/solver/method.md).
#ifndef DRAPE_LIB_PREDICT_GLSL_
#define DRAPE_LIB_PREDICT_GLSL_

#include "lib/vector.glsl"

// u = v + a h/2, so that p + h u is the ballistic position. Bender et al. 2009, section 3.1, eq. 2.
// v [m/s], a [m/s^2], half_h [s].
vec3 MeanVelocity(vec3 v, vec3 a, float half_h) { return AddScaled(v, half_h, a); }

// The part of the way to its target that a pin moves in this substep: the rest of the way divided by the shares
// that remain. Exactly 0 where the target is p. [m].
vec3 PinWay(vec3 p, vec3 target, uint remaining_shares) {
  precise vec3 rest = target - p;
  return Quotient(rest, float(remaining_shares));
}

#endif
