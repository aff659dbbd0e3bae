// Stages `solve_distance`, `solve_strips`: the direction in which an impulse acts (settings.direction;
// server/solver/method.md, "Direction").
#ifndef DRAPE_LIB_DIRECTION_GLSL_
#define DRAPE_LIB_DIRECTION_GLSL_

#include "lib/vector.glsl"

struct ImpulseLine {
  vec3 direction;
  float slope;  // the share of a displacement along it that changes the length: direction . n_end
};

// For a constraint between particles that are start [m] apart at the start of the substep and in the unit
// direction n_end at its end; `end_share` in [0, 1) of the latter.
ImpulseLine BlendDirections(vec3 start, vec3 n_end, float end_share) {
  vec3 n_start = Direction(start, Length(start), vec3(1.0, 0.0, 0.0));
  float share = Dot(n_start, n_end) < MIN_DIRECTION_COSINE ? 1.0 : end_share;
  precise float start_share = 1.0 - share;
  precise vec3 direction = start_share * n_start + share * n_end;
  return ImpulseLine(direction, Dot(direction, n_end));
}

#endif
