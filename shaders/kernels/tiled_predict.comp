// Kernel `tiled_predict`: stage predict, and the start of the substep's sweeps; where nothing comes between, before it
// the stages integrate and correct_velocity of the substep before, which is not the last one of its step. One
// invocation = one particle and one pin. Reads Scratch, Models, Parameters; writes Scratch (positions [m], velocities:
// u, rebounds [m/s]).
#include "stages/access_tiled.glsl"
#include "stages/predict.glsl"
#include "stages/solve_contacts.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_INTEGRATES) uniform uint integrates;  // 0 or 1

void EndSubstepBefore(uint i) {
  BeginSubstep(substep_index - 1u);
  if (i < cloth.particle_count && InverseMass(i) != 0.0) {
    IntegrateParticle(i);
    CorrectVelocity(i);
  }
  // Where PredictPin finds them.
  if (i < cloth.pin_count && !IsOpen(PinParticle(i))) IntegrateParticle(PinParticle(i));
}

void main() {
  OpenCloth(gl_WorkGroupID.y);
#ifdef HAS_COLLIDER_REACH
  LoadReach(status_index);
#endif
  if (substep_index >= cloth.step.substeps) return;
  uint i = gl_GlobalInvocationID.x;
  if (integrates != 0u) EndSubstepBefore(i);
  BeginSubstep(substep_index);
  if (i < cloth.particle_count) PredictParticle(i);
  if (i < cloth.pin_count) PredictPin(i);
}
