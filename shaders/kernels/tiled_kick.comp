// Kernel `tiled_kick`: stage apply_springs, second phase: v += h A, or h/2 A at the ends of the step.
// One invocation = one particle. Reads Scratch (accelerations [m/s^2]); writes Scratch (velocities).
#include "stages/access_tiled.glsl"
#include "stages/apply_springs.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  uint i = gl_GlobalInvocationID.x;
  if (i < cloth.particle_count && IsKickDue(substep)) KickParticle(i, KickSeconds(substep));
}
