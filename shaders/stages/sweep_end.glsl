// How many sweeps a substep of the tiled plan has: max_iterations, and with self-contacts some more after hard hits.
#ifndef DRAPE_STAGES_SWEEP_END_GLSL_
#define DRAPE_STAGES_SWEEP_END_GLSL_

#include "stages/access_tiled.glsl"

// Whether the substep has fewer sweeps.
bool IsBeyondSweeps(uint sweep) {
#ifdef HAS_SOLVE_SELF_CONTACTS
  return sweep >= max(cloth.step.max_iterations, statuses[status_index].most_sweeps);
#else
  return sweep >= cloth.step.max_iterations;
#endif
}

#ifdef HAS_SOLVE_SELF_CONTACTS
// The sweep under way found that the substep is to have `most`: the sweep goes on, and others come if there are more.
void EndSweepOfContacts(uint sweep, uint most) {
  statuses[status_index].most_sweeps = max(most, sweep + 1u);
  if (sweep >= cloth.step.max_iterations) statuses[status_index].hit_sweeps += 1u;
}
#endif

#endif
