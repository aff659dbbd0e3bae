// Kernel `tiled_correct_velocity`: stage correct_velocity where solve_velocity or guard_self_contacts is between it
// and integrate. One invocation = one particle. Reads Scratch, Models, Parameters; writes Scratch
// (velocities: v [m/s]).
#include "stages/access_tiled.glsl"
#include "stages/solve_contacts.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  uint i = gl_GlobalInvocationID.x;
  if (substep_index >= cloth.step.substeps || i >= cloth.particle_count) return;
#ifdef HAS_COLLIDER_REACH
  LoadReach(status_index);
#endif
  BeginSubstep(substep_index);
  CorrectVelocity(i);
}
