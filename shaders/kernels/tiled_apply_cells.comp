// Kernel `tiled_apply_cells`: stage solve_elastic, second phase of a family of cells. One invocation = one particle.
// Reads Models, Scratch (impulses of the cells [N s]); writes Scratch (velocities: u [m/s]).
#include "stages/access_tiled.glsl"
#include "stages/solve_elastic.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_PHASE) uniform uint phase;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  uint i = gl_GlobalInvocationID.x;
  if (substep_index >= cloth.step.substeps || phase >= cloth.elastic_family_count) return;
  if (LoadFamily(phase).kind != DRAPE_ELASTIC_CELLS || i >= cloth.particle_count) return;
  BeginSubstep(substep_index);
  ApplyCells(i);
}
