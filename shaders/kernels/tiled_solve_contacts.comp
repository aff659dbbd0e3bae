// Kernel `tiled_solve_contacts`: stage solve_contacts (Bender et al. 2009, section 4.1). One invocation =
// one particle. Reads Parameters, Scratch; writes Scratch (velocities: u, betas [m/s], met colliders), Statuses
// (sweep_changed).
#include "stages/access_tiled.glsl"
#include "stages/solve_contacts.glsl"
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
#ifdef HAS_COLLIDER_REACH
  LoadReach(status_index);
#endif
  BeginSubstep(substep_index);
  uint i = gl_GlobalInvocationID.x;
  if (i < cloth.particle_count) SolveContactsOf(i, sweep == 0u);
}
