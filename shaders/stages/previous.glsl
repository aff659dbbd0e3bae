// The state one substep before, for two steps.
#ifndef DRAPE_STAGES_PREVIOUS_GLSL_
#define DRAPE_STAGES_PREVIOUS_GLSL_

#include "stages/buffers.glsl"

#ifdef HAS_TWO_STEPS
void SetPrevious(uint i, vec3 p, vec3 v) {
  SetScratchVector(cloth.scratch.previous_positions + 3u * i, p);
  SetScratchVector(cloth.scratch.previous_velocities + 3u * i, v);
}
#endif

#endif
