// Kernel `tiled_predict`: stage predict, and the start of the substep's sweeps. One invocation = one
// particle and one pin. Reads Scratch, Models, Parameters; writes Scratch (velocities: u, rebounds [m/s]).
#include "stages/access_tiled.glsl"
#include "stages/predict.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;

void main() {
  OpenCloth(gl_WorkGroupID.y);
#if defined(HAS_COLLIDER_REACH) && defined(HAS_QUIET_LINKS)
  LoadReach(status_index);
#endif
  if (substep_index >= cloth.step.substeps) return;
  BeginSubstep(substep_index);
  uint i = gl_GlobalInvocationID.x;
  if (i < cloth.particle_count) PredictParticle(i);
  if (i < cloth.pin_count) PredictPin(i);
}
