// Kernel `tiled_solve_velocity`: stage solve_velocity for one colour of the constraints or of
// the joints. One invocation = one of them. Reads Models, Scratch; writes Scratch
// (velocities: v [m/s]).
#include "stages/access_tiled.glsl"
#include "stages/solve_velocity.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_SWEEP) uniform uint sweep;
layout(location = DRAPE_UNIFORM_COLOUR) uniform uint colour;
layout(location = DRAPE_UNIFORM_IS_OF_JOINTS) uniform uint is_of_joints;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  if (substep_index >= cloth.step.substeps || sweep >= cloth.step.velocity_iterations) return;
#ifdef HAS_IMPULSES
  BeginImpulses(substep_index);
#endif
#ifdef HAS_SOLVE_JOINTS
  if (is_of_joints != 0u) {
    if (colour >= cloth.joint_colour_count) return;
    uint j = models[cloth.model.joint_colour_offsets + colour] + gl_GlobalInvocationID.x;
    if (j < models[cloth.model.joint_colour_offsets + colour + 1u]) SolveJointVelocity(j);
    return;
  }
#endif
  if (colour >= cloth.colour_count) return;
  uint k = models[cloth.model.colour_offsets + colour] + gl_GlobalInvocationID.x;
  if (k < models[cloth.model.colour_offsets + colour + 1u]) SolveLinkVelocity(k);
}
