// Kernel `tiled_tether`: stage tether. One invocation = one particle. Reads Models, Scratch; writes
// Scratch (velocities: u [m/s]).
#include "stages/access_tiled.glsl"
#include "stages/tether.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  uint i = gl_GlobalInvocationID.x;
  if (i >= cloth.particle_count || substep_index >= cloth.step.substeps) return;
  BeginSubstep(substep_index);
  TetherParticle(i);
}
