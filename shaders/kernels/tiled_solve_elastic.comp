// Kernel `tiled_solve_elastic`: stage solve_elastic for one family. One invocation = one line. Reads Models,
// Parameters, Scratch (positions); writes Scratch (velocities: u [m/s], solutions).
#include "stages/access_tiled.glsl"
#include "stages/solve_elastic.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_PHASE) uniform uint phase;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  if (substep_index >= cloth.step.substeps || phase >= cloth.elastic_family_count) return;
  ElasticFamily family = LoadFamily(phase);
  uint line = family.line_begin + gl_GlobalInvocationID.x;
  if (line >= family.line_end) return;
  BeginSubstep(substep_index);
  SolveElasticLine(family, line);
}
