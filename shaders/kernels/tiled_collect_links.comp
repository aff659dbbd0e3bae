// Kernel `tiled_collect_links`: stage refine, second phase of a round: lists the constraints at flagged particles, by
// colour. The order within a colour changes from run to run and changes no result: constraints of one colour
// share no free particle. One invocation = one constraint. Reads Models, Scratch (flags); writes Scratch (lists
// and their lengths).
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
  if (scratch_words[HasFlagsWord()] == 0u) return;
  uint k = gl_GlobalInvocationID.x;
  if (k >= cloth.constraint_count || !IsAtFlag(k)) return;
  uint colour = 0u;
  while (k >= models[cloth.model.colour_offsets + colour + 1u]) ++colour;
  uint place = atomicAdd(scratch_words[RefinedCountWord(colour)], 1u);
  scratch_words[cloth.scratch.refined_links + models[cloth.model.colour_offsets + colour] + place] = k;
}
