// Kernel `tiled_apply_wind`: stage apply_wind, second phase. One invocation = one particle. Reads Models,
// Scratch (impulses [N s]); writes Scratch (velocities [m/s]).
#include "stages/access_tiled.glsl"
#include "stages/apply_wind.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_KICK_PLACE) uniform uint place;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  uint i = gl_GlobalInvocationID.x;
  if (i >= cloth.particle_count || substep_index >= cloth.step.substeps) return;
  BeginSubstep(substep_index);
  if (KickSeconds(place) != 0.0) ApplyAirImpulses(i);
}
