// When and how long kicks (springs, air) act, and on what. Needs the accessors of one plan.
#ifndef DRAPE_STAGES_KICK_GLSL_
#define DRAPE_STAGES_KICK_GLSL_

#include "lib/vector.glsl"
#include "stages/substep.glsl"

// Seconds of the kick before, within or after the substep `index`; 0: none.
float KickSeconds(uint index, uint place) {
  if (index >= cloth.substeps) return 0.0;
  if (place == DRAPE_KICK_BEFORE) return index == 0u ? cloth.first_kick : 0.0;
#ifdef HAS_TWO_STEPS
  if (place == DRAPE_KICK_WITHIN) return index > 0u ? cloth.intervals[min(index, 2u)] : 0.0;
  return index == 0u ? cloth.first_kick : 0.0;
#else
  if (place == DRAPE_KICK_WITHIN) return 0.0;
  return index + 1u == cloth.substeps ? cloth.half_h : cloth.h;
#endif
}

// Where particle i is when it is kicked: within a substep where it is predicted to be.
vec3 KickPosition(uint i, uint place) {
#ifdef HAS_TWO_STEPS
  if (place == DRAPE_KICK_WITHIN) return AddScaled(Position(i), substep.interval, Velocity(i));
#endif
  return Position(i);
}

#endif
