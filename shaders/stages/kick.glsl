// Durations and places of the kicks (springs, elastic elements, air) of a substep. Needs the accessors of one
// plan.
#ifndef DRAPE_STAGES_KICK_GLSL_
#define DRAPE_STAGES_KICK_GLSL_

#include "lib/vector.glsl"
#include "stages/substep.glsl"

// Seconds of the kick before, within or after the substep under way; 0: none.
float KickSeconds(uint place) {
  if (place == DRAPE_KICK_BEFORE) return substep.kick_before;
  return place == DRAPE_KICK_WITHIN ? substep.kick_within : substep.kick_after;
}

// The position of particle i in a kick; within a substep and in `solve_hinges`, its predicted position.
vec3 KickPosition(uint i, uint place) {
#ifdef HAS_TWO_STEPS
  if (place == DRAPE_KICK_WITHIN) return AddScaled(Position(i), substep.interval, Velocity(i));
#endif
#ifdef HAS_SOLVE_HINGES
  if (place == DRAPE_KICK_HINGES) return AddScaled(Position(i), substep.interval + hinge_lead, Velocity(i));
#endif
  return Position(i);
}

#endif
