// Kernel `tiled_solve_self_contacts`: stage solve_self_contacts, one sweep over the pairs, turn by turn. One work group
// = one cloth; an invocation takes every LOCAL_SIZE-th pair of a turn. Reads Models, Parameters, Scratch (pairs,
// turns); writes Scratch (velocities: u [m/s], pushes), Statuses (sweep_changed, most_sweeps).
#define COUNTS_IN_SCRATCH
#define SOLVES_IN_SCRATCH
#include "stages/self_contact_pairs.glsl"
#include "stages/sweep_end.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_SWEEP) uniform uint sweep;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  if (substep_index >= cloth.step.substeps || IsBeyondSweeps(sweep)) return;
#ifdef HAS_TOLERANCE
  if (statuses[status_index].is_substep_done != 0u) return;
#endif
  LoadSelfContacts();
  LoadContactState();
  BeginSubstep(substep_index);
  BeginOffers();
  float hardest_sq = 0.0;
  for (uint turn = 0u; turn < turn_count; ++turn) {
    uint begin = TurnBegin(turn);
    uint end = TurnEnd(turn);
    FOR_EACH(o, begin, end) hardest_sq = max(hardest_sq, SolvePair(scratch_words[contact.order + o]));
    EndPhase();
  }
  OfferSize(0u, hardest_sq);
  EndOffers();
  if (gl_LocalInvocationID.x != 0u) return;
  precise float hardest = substep.interval * Root(LargestSize(0u));
  // A pair that moves its nearest points so far strains the links until the next substep (method.md, «Hard hits»).
  precise float hard = HARD_HIT * contact.edge_length;
  bool has_hit = hardest > hard;
  uint most = cloth.step.max_iterations + (has_hit ? HIT_SWEEPS : 0u);
  EndSweepOfContacts(sweep, most);
#ifdef HAS_TOLERANCE
  if (hardest > cloth.step.contact_tolerance) MarkChanged();
#endif
}
