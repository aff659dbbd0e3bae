// Kernel `tiled_end_sweep`: with a tolerance, counts the sweep of every cloth still at work, closes the
// substep of those whose sweep changed nothing (Bender et al. 2009, section 3.2: no error above the
// tolerance), and switches the indirect dispatches off when none is left. One work group; an invocation
// takes every LOCAL_SIZE-th cloth. Writes Statuses, Dispatches.
#include "stages/access_tiled.glsl"
#include "stages/sweep_end.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_ITEM_COUNT) uniform uint item_count;
layout(location = DRAPE_UNIFORM_SWEEP) uniform uint sweep;
layout(location = DRAPE_UNIFORM_DISPATCH_COUNT) uniform uint dispatch_count;

shared uint is_any_at_work;

// Whether the cloth has another sweep.
bool EndSweep(uint item) {
  OpenCloth(item);
  if (statuses[status_index].is_substep_done != 0u) return false;
  statuses[status_index].iterations += 1u;
  bool has_converged = statuses[status_index].sweep_changed == 0u;
  bool is_last = IsBeyondSweeps(sweep + 1u);
  statuses[status_index].sweep_changed = 0u;
  if (!has_converged && is_last) statuses[status_index].unconverged_substeps += 1u;
  if (has_converged || is_last) statuses[status_index].is_substep_done = 1u;
  return !has_converged && !is_last;
}

void main() {
  if (gl_LocalInvocationID.x == 0u) is_any_at_work = 0u;
  memoryBarrierShared();
  barrier();
  for (uint item = gl_LocalInvocationID.x; item < item_count; item += LOCAL_SIZE) {
    if (EndSweep(item)) is_any_at_work = 1u;
  }
  memoryBarrierShared();
  barrier();
  if (is_any_at_work != 0u) return;
  for (uint d = gl_LocalInvocationID.x; d < dispatch_count; d += LOCAL_SIZE) {
    dispatches[d].group_count_y = 0u;
  }
}
