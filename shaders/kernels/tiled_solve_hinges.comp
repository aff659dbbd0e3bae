// Kernel `tiled_solve_hinges`: stage solve_hinges, second phase of a stage. One invocation = one particle. Reads Models,
// Parameters, Scratch (impulses [N s]); writes Scratch (velocities: u, their changes [m/s]).
#include "stages/access_tiled.glsl"
#include "stages/solve_hinges.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_PHASE) uniform uint stage;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  uint i = gl_GlobalInvocationID.x;
  if (substep_index >= cloth.step.substeps || stage >= cloth.hinge_stage_count || i >= cloth.particle_count) return;
  BeginSubstep(substep_index);
  ApplyHinges(i, stage);
}
