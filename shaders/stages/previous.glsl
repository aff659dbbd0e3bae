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

#ifdef HAS_REMAINDERS
// What rounding took from a position, of b within a substep, and the same one substep before [m].
struct Remainders {
  vec3 now;
  vec3 previous;
};
Remainders StoredRemainders(uint i) {
  return Remainders(ScratchVector(cloth.scratch.remainders + 6u * i),
                    ScratchVector(cloth.scratch.remainders + 6u * i + 3u));
}
void StoreRemainders(uint i, Remainders remainders) {
  SetScratchVector(cloth.scratch.remainders + 6u * i, remainders.now);
  SetScratchVector(cloth.scratch.remainders + 6u * i + 3u, remainders.previous);
}
Remainders NoRemainders() { return Remainders(vec3(0.0), vec3(0.0)); }
#endif

#ifdef OWNS_PARTICLE
vec3 previous_position;
vec3 previous_velocity;
vec3 PreviousPosition(uint i) { return previous_position; }
vec3 PreviousVelocity(uint i) { return previous_velocity; }
void SetPrevious(uint i, vec3 p, vec3 v) {
  previous_position = p;
  previous_velocity = v;
}
#ifdef HAS_REMAINDERS
Remainders own_remainders;
Remainders RemaindersOf(uint i) { return own_remainders; }
void SetRemainders(uint i, Remainders remainders) { own_remainders = remainders; }
#endif
#else
vec3 PreviousPosition(uint i) { return StoredPreviousPosition(i); }
vec3 PreviousVelocity(uint i) { return StoredPreviousVelocity(i); }
void SetPrevious(uint i, vec3 p, vec3 v) { StorePrevious(i, p, v); }
#ifdef HAS_REMAINDERS
Remainders RemaindersOf(uint i) { return StoredRemainders(i); }
void SetRemainders(uint i, Remainders remainders) { StoreRemainders(i, remainders); }
#endif
#endif
#endif

#endif
