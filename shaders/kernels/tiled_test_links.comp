// Kernel `tiled_test_links`: stage refine, first phase: flags the ends of links that are far off. One
// invocation = one link of a strip. Reads Models, Scratch (positions [m], velocities: u [m/s]); writes
// Scratch (flags).
#define COUNTS_IN_SCRATCH
#include "stages/access_tiled.glsl"
#include "stages/refine.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_SWEEP) uniform uint sweep;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  if (substep_index >= cloth.substeps || sweep >= cloth.max_iterations) return;
#ifdef HAS_TOLERANCE
  if (statuses[status_index].is_substep_done != 0u) return;
#endif
  BeginSubstep(substep_index);
  uint k = gl_GlobalInvocationID.x;
  if (k < cloth.tested_link_count) TestLink(k);
}
