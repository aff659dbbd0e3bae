// Kernel `tiled_spring_accelerations`: stage apply_springs, first phase; also for `predict` with
// IN_FORCE. One invocation = one particle. Reads Models, Scratch (positions, velocities); writes Scratch
// (accelerations [m/s^2]).
#include "stages/access_tiled.glsl"
#include "stages/apply_springs.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_KICK_PLACE) uniform uint place;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  uint i = gl_GlobalInvocationID.x;
  if (i >= cloth.particle_count || substep_index >= cloth.step.substeps) return;
  BeginSubstep(substep_index);
  StoreSpringAcceleration(i, place);
}
