// Kernel `tiled_test_links`: stage refine, first phase of a round: flags the ends of links to refine.
// One invocation = one constraint. Reads Models, Scratch (positions [m], velocities: u [m/s]); writes
// Scratch (flags).
#define COUNTS_IN_SCRATCH
#include "stages/access_tiled.glsl"
#include "stages/refine.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_SWEEP) uniform uint sweep;
layout(location = DRAPE_UNIFORM_ROUND) uniform uint refine_round;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  if (!IsRefinedIn(substep_index, sweep, refine_round)) return;
#ifdef HAS_TOLERANCE
  if (statuses[status_index].is_substep_done != 0u) return;
#endif
  if (refine_round > 0u && scratch_words[RefineSolvesWord()] >= cloth.step.refine_solves) return;
  BeginSubstep(substep_index);
  uint k = gl_GlobalInvocationID.x;
  if (k < cloth.constraint_count) TestLink(k);
}
