// Kernel `tiled_tether`: stage tether. One invocation = one particle. Reads Models, Scratch; writes
// Scratch (velocities: u [m/s]).
#include "stages/access_tiled.glsl"
#include "stages/tether.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  BeginSubstep(substep_index);
  uint i = gl_GlobalInvocationID.x;
  if (substep_index < cloth.substeps && i < cloth.particle_count) ApplyTethers(i);
}
