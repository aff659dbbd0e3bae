// Kernel `tiled_twist_changes`: stage damp_twist, first phase: the change of each particle by the twists of its cells.
// One invocation = one particle. Reads Scratch (velocities: u [m/s]); writes Scratch
// (changes [m/s]).
#include "stages/access_tiled.glsl"
#include "stages/damp_twist.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  uint i = gl_GlobalInvocationID.x;
  if (substep_index >= cloth.step.substeps || i >= cloth.particle_count) return;
  BeginSubstep(substep_index);
  if (substep.twist_share != 0.0) StoreTwistChange(i);
}
