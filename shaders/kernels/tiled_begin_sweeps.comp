// Kernel `tiled_begin_sweeps`: with a tolerance, opens the sweeps of a substep for every cloth that has
// this substep and switches the indirect dispatches on. One work group; an invocation takes every
// LOCAL_SIZE-th cloth. Writes Statuses, Dispatches.
#include "stages/access_tiled.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_ITEM_COUNT) uniform uint item_count;
layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_DISPATCH_COUNT) uniform uint dispatch_count;

void main() {
  for (uint item = gl_LocalInvocationID.x; item < item_count; item += LOCAL_SIZE) {
    OpenCloth(item);
    statuses[status_index].sweep_changed = 0u;
    statuses[status_index].is_substep_done = substep_index < cloth.step.substeps ? 0u : 1u;
  }
  for (uint d = gl_LocalInvocationID.x; d < dispatch_count; d += LOCAL_SIZE) {
    dispatches[d].group_count_y = dispatches[d].active_group_count_y;
  }
}
