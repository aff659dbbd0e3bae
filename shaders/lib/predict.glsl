// Stage `predict`: the mean velocity over a substep (server/solver/README.md, step 2).
#ifndef DRAPE_LIB_PREDICT_GLSL_
#define DRAPE_LIB_PREDICT_GLSL_

#include "lib/vector.glsl"

// u = v + a h/2, so that p + h u is the ballistic position. Bender et al. 2009, section 3.1, eq. 2.
// v [m/s], a [m/s^2], half_h [s].
vec3 MeanVelocity(vec3 v, vec3 a, float half_h) { return AddScaled(v, half_h, a); }

// The velocity that takes a pin from p to its share of the way to the target in this substep: the rest
// of the way divided by the substeps that remain. Exactly 0 where the target is p. [m], [1/s].
vec3 PinVelocity(vec3 p, vec3 target, uint remaining_substeps, float inverse_h) {
  precise vec3 way = (target - p) / float(remaining_substeps);
  precise vec3 velocity = way * inverse_h;
  return velocity;
}

#endif
