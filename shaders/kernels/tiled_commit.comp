// Kernel `tiled_commit`: stage commit, last phase: the new state replaces the old one unless the cloth is faulted or
// the step is to be done again. One invocation = one particle. Reads Scratch, Statuses; writes States, Statuses
// (iterations when their number is fixed).
#include "stages/access_tiled.glsl"
#ifdef HAS_SOLVE_SELF_CONTACTS
#include "interface/self_contact_record.h"
#endif

layout(local_size_x = LOCAL_SIZE) in;

#ifdef HAS_SOLVE_SELF_CONTACTS
// Whether the step is to be done again with longer lists of pairs.
bool NeedsMorePairs() {
  return statuses[status_index].contact_pairs > parameters[cloth.step.self_contacts + DRAPE_CONTACT_CAPACITY] &&
         parameters[cloth.step.self_contacts + DRAPE_CONTACT_MAY_GROW] != 0u;
}
#endif

void main() {
  OpenCloth(gl_WorkGroupID.y);
  uint i = gl_GlobalInvocationID.x;
#ifndef HAS_TOLERANCE
  if (i == 0u) statuses[status_index].iterations = cloth.step.substeps * cloth.step.max_iterations;
#ifdef HAS_SOLVE_SELF_CONTACTS
  if (i == 0u) statuses[status_index].iterations += statuses[status_index].hit_sweeps;
#endif
#endif
  if (i >= cloth.particle_count || statuses[status_index].fault != 0u) return;
#ifdef HAS_ENERGY_WATCH
  if (statuses[status_index].gained_energy != 0u && cloth.step.keeps_start_of_gain != 0u) return;
#endif
#ifdef HAS_SOLVE_SELF_CONTACTS
  if (NeedsMorePairs()) return;
#endif
  SetStateVector(cloth.positions + 3u * i, Position(i));
  SetStateVector(cloth.velocities + 3u * i, Velocity(i));
}
