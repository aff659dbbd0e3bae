// Kernel `tiled_integrate`: stages integrate and, without solve_velocity
// or guard_self_contacts between them, correct_velocity. One invocation = one particle. Reads
// Scratch, Models, Parameters; writes Scratch (positions [m], velocities: v [m/s], violations [m]).
#include "stages/access_tiled.glsl"
#include "stages/predict.glsl"
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
#ifdef HAS_SOLVE_CONTACTS
  if (substep_index + 1u == cloth.step.substeps) StoreContactViolation(i);
#endif
  IntegrateParticle(i);
#if !defined(HAS_SOLVE_VELOCITY) && !defined(HAS_GUARD_SELF_CONTACTS)
  CorrectVelocity(i);
#endif
}
