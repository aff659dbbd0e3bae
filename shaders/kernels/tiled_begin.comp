// Kernel `tiled_begin`: copies the committed state to the working state of the step and clears the status and the
// flags of `refine`. One invocation = one particle. Reads States; writes Scratch, Statuses.
#include "stages/access_tiled.glsl"
#include "stages/previous.glsl"

layout(local_size_x = LOCAL_SIZE) in;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  uint i = gl_GlobalInvocationID.x;
  if (i == 0u) {
    statuses[status_index].iterations = 0u;
    statuses[status_index].unconverged_substeps = 0u;
    statuses[status_index].fault = 0u;
    statuses[status_index].sweep_changed = 0u;
    statuses[status_index].is_substep_done = 0u;
    statuses[status_index].holds_until = 0u;
#ifdef HAS_COLLIDER_REACH
    for (int k = 0; k < DRAPE_RANGE_WORDS; ++k) statuses[status_index].range[k] = 0u;
    statuses[status_index].far_colliders = 0u;
#endif
#ifdef HAS_FIND_SELF_CONTACTS
    statuses[status_index].contact_pairs = 0u;
    statuses[status_index].contacts_failed = 0u;
    statuses[status_index].contacts_given_up = 0u;
    statuses[status_index].most_sweeps = 0u;
    statuses[status_index].hit_sweeps = 0u;
#endif
  }
  if (i >= cloth.particle_count) return;
  SetPosition(i, StateVector(cloth.positions + 3u * i));
  SetVelocity(i, StateVector(cloth.velocities + 3u * i));
#ifdef HAS_REFINE
  // The flags of the particles, whether there are any, the lengths of the lists, their sum so far. Zero has the
  // same bits in both types.
  uint flag_count = cloth.particle_count + 2u + cloth.colour_count;
  for (uint word = i; word < flag_count; word += cloth.particle_count) {
    scratch[cloth.scratch.stretched_flags + word] = 0.0;
  }
#endif
#ifdef HAS_TWO_STEPS
  SetPrevious(i, Position(i), Velocity(i));
#endif
#ifdef HAS_REMAINDERS
  SetRemainders(i, NoRemainders());
#endif
}
