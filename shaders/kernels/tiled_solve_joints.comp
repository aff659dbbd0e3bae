// Kernel `tiled_solve_joints`: stage solve_joints for one colour of the joints (Bender et al. 2009,
// sections 3.2 and 3.3). One invocation = one joint. Reads Models, Scratch; writes Scratch (velocities: u
// [m/s], joint lambdas [N s]), Statuses (sweep_changed).
#include "stages/access_tiled.glsl"
#include "stages/solve_joints.glsl"
#include "stages/sweep_end.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_SWEEP) uniform uint sweep;
layout(location = DRAPE_UNIFORM_COLOUR) uniform uint colour;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  if (substep_index >= cloth.step.substeps || IsBeyondSweeps(sweep)) return;
  if (colour >= cloth.joint_colour_count) return;
#ifdef HAS_TOLERANCE
  if (statuses[status_index].is_substep_done != 0u) return;
#endif
#ifdef HAS_IMPULSES
  BeginImpulses(substep_index);
#endif
  uint k = models[cloth.model.joint_colour_offsets + colour] + gl_GlobalInvocationID.x;
  uint end = models[cloth.model.joint_colour_offsets + colour + 1u];
  if (k < end) SolveJoint(k, sweep == 0u);
}
