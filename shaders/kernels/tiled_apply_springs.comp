// Kernel `tiled_apply_springs`: stage apply_springs, second phase: v += A times the duration of the kick. One
// invocation = one particle. Reads Scratch (accelerations [m/s^2]); writes Scratch (velocities).
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
  float seconds = KickSeconds(place);
  if (seconds != 0.0) KickParticle(i, seconds);
}
