// Kernel `tiled_hinge_impulses`: stage solve_hinges, first phase of a stage. One invocation = one hinge. Reads Models,
// Scratch (positions, velocities); writes Scratch (impulses [N s]).
#include "stages/access_tiled.glsl"
#include "stages/solve_hinges.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_PHASE) uniform uint stage;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  uint e = gl_GlobalInvocationID.x;
  if (substep_index >= cloth.step.substeps || stage >= cloth.hinge_stage_count || e >= cloth.elastic_count) return;
  BeginSubstep(substep_index);
  StoreHingeImpulse(e);
}
