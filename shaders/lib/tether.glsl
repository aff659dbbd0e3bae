// Stage `tether`: no particle is farther from a pin than the length of cloth between them
// (server/solver/method.md).
#ifndef DRAPE_LIB_TETHER_GLSL_
#define DRAPE_LIB_TETHER_GLSL_

#include "lib/direction.glsl"
#include "lib/vector.glsl"

// u of the particle, for d [m] from the pin to it as predicted at the end of the substep: if |d| is beyond `reach`
// [m], the excess is removed within h. Bender et al. 2009, section 3.2, for the inequality reach - |d| >= 0 and a
// pin of inverse mass 0. `start` is d at the start of the substep and `end_share` the weight of the direction at
// its end; both only with start directions. u [m/s], inverse_h [1/s].
vec3 TetheredVelocity(vec3 u, vec3 start, vec3 d, float reach, float inverse_h, float end_share) {
  // Slack ones need no root. A chain at rest has exactly this length, up to the rounding of the squares, of which a
  // root that is one ulp too large would make a pull in every substep.
  precise float slack_sq = (reach * reach) * SLACK_RATIO_SQ;
  if (Dot(d, d) <= slack_sq) return u;
  float length_d = Length(d);
  precise float speed = (length_d - reach) * inverse_h;
#ifdef HAS_START_DIRECTIONS
  vec3 n_end = Direction(d, length_d, vec3(1.0, 0.0, 0.0));
  ImpulseLine line = BlendDirections(start, n_end, end_share);
  precise float scale = speed / line.slope;
  return AddScaled(u, -scale, line.direction);
#else
  precise float speed_per_length = speed / length_d;
  return AddScaled(u, -speed_per_length, d);
#endif
}

#endif
