// The state one substep before, for two steps.
#ifndef DRAPE_STAGES_PREVIOUS_GLSL_
#define DRAPE_STAGES_PREVIOUS_GLSL_

#include "stages/buffers.glsl"

#ifdef HAS_TWO_STEPS
vec3 StoredPreviousPosition(uint i) { return ScratchVector(cloth.scratch.previous_positions + 3u * i); }
vec3 StoredPreviousVelocity(uint i) { return ScratchVector(cloth.scratch.previous_velocities + 3u * i); }
void StorePrevious(uint i, vec3 p, vec3 v) {
  SetScratchVector(cloth.scratch.previous_positions + 3u * i, p);
  SetScratchVector(cloth.scratch.previous_velocities + 3u * i, v);
}

#ifdef OWNS_PARTICLE
vec3 previous_position;
vec3 previous_velocity;
vec3 PreviousPosition(uint i) { return previous_position; }
vec3 PreviousVelocity(uint i) { return previous_velocity; }
void SetPrevious(uint i, vec3 p, vec3 v) {
  previous_position = p;
  previous_velocity = v;
}
#else
vec3 PreviousPosition(uint i) { return StoredPreviousPosition(i); }
vec3 PreviousVelocity(uint i) { return StoredPreviousVelocity(i); }
void SetPrevious(uint i, vec3 p, vec3 v) { StorePrevious(i, p, v); }
#endif
#endif

#endif
