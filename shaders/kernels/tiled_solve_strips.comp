// Kernel `tiled_solve_strips`: stage solve_strips for one phase. One invocation = one strip. Reads Models,
// Scratch; writes Scratch (velocities: u [m/s], lambdas [N s], links), Statuses (sweep_changed).
#include "stages/access_tiled.glsl"
#include "stages/solve_strips.glsl"
#include "stages/sweep_end.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_SWEEP) uniform uint sweep;
layout(location = DRAPE_UNIFORM_PHASE) uniform uint phase;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  if (substep_index >= cloth.step.substeps || IsBeyondSweeps(sweep)) return;
  if (phase >= cloth.strip_phase_count) return;
#ifdef HAS_TOLERANCE
  if (statuses[status_index].is_substep_done != 0u) return;
#endif
  BeginSubstep(substep_index);
  uint strip = models[cloth.model.strip_phases + phase] + gl_GlobalInvocationID.x;
  uint end = models[cloth.model.strip_phases + phase + 1u];
  if (strip < end) SolveStrip(strip, sweep == 0u);
}
