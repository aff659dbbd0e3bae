// Kernel `tiled_refine`: stage refine, last phases of a round: sweeps over the listed constraints colour by
// colour, counts them, then clears flags and lists. One work group = one cloth; an invocation takes every
// LOCAL_SIZE-th constraint. Reads Models, Scratch (lists, velocities: u [m/s]); writes Scratch (positions [m],
// flags, lengths of the lists, how many were solved).
#define COUNTS_IN_SCRATCH
#define SOLVES_IN_SCRATCH
#include "stages/access_tiled.glsl"
#include "stages/refine.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_SWEEP) uniform uint sweep;
layout(location = DRAPE_UNIFORM_ROUND) uniform uint refine_round;

#define FOR_EACH(index, begin, end) \
  for (uint index = (begin) + gl_LocalInvocationID.x; index < (end); index += LOCAL_SIZE)

// One of the kernels of the tiled plan that have phases of their own.
void EndPhase() {
  memoryBarrierBuffer();
  barrier();
}

// Words of Scratch: the list of a colour, and its end.
uvec2 ListOf(uint colour) {
  uint begin = cloth.scratch.refined_links + models[cloth.model.colour_offsets + colour];
  return uvec2(begin, begin + scratch_words[RefinedCountWord(colour)]);
}

void Refine() {
  for (uint colour = 0u; colour < cloth.colour_count; ++colour) {
    uvec2 list = ListOf(colour);
    FOR_EACH(word, list.x, list.y) RefineConstraint(scratch_words[word]);
    EndPhase();
  }
}

// Every flagged particle is the end of a listed constraint.
void Clear() {
  for (uint colour = 0u; colour < cloth.colour_count; ++colour) {
    uvec2 list = ListOf(colour);
    FOR_EACH(word, list.x, list.y) {
      uvec2 pair = ConstraintPair(scratch_words[word]);
      scratch_words[cloth.scratch.stretched_flags + pair.x] = 0u;
      scratch_words[cloth.scratch.stretched_flags + pair.y] = 0u;
    }
  }
  EndPhase();
  if (gl_LocalInvocationID.x != 0u) return;
  scratch_words[HasFlagsWord()] = 0u;
  for (uint colour = 0u; colour < cloth.colour_count; ++colour) {
    scratch_words[RefineSolvesWord()] += REFINE_SWEEPS * scratch_words[RefinedCountWord(colour)];
    scratch_words[RefinedCountWord(colour)] = 0u;
  }
}

void main() {
  OpenCloth(gl_WorkGroupID.y);
  if (!IsRefinedIn(substep_index, sweep, refine_round)) return;
#ifdef HAS_TOLERANCE
  if (statuses[status_index].is_substep_done != 0u) return;
#endif
  if (scratch_words[HasFlagsWord()] == 0u) return;
  BeginSubstep(substep_index);
  for (uint k = 0u; k < REFINE_SWEEPS; ++k) Refine();
  Clear();
}
