// Kernel `tiled_solve_strips`: stage solve_strips for one phase. One invocation = one strip, or from both ends one work
// group = one block of strips. Reads Models, Scratch; writes Scratch (velocities: u [m/s], lambdas [N s], links),
// Statuses (sweep_changed).
#include "stages/access_tiled.glsl"
#include "stages/solve_strips.glsl"
#include "stages/sweep_end.glsl"
// Each file is included once, so those under a condition come last.
#ifdef HAS_STRIP_HALVES
// One of the kernels of the tiled plan that have phases of their own, in shared memory alone.
void PhaseBarrier() {
  memoryBarrierShared();
  barrier();
}
#include "stages/meet_strips.glsl"
#endif

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
#ifdef HAS_STRIP_HALVES
  uint block = models[cloth.model.strip_phase_blocks + phase] + gl_WorkGroupID.x;
  if (block >= models[cloth.model.strip_phase_blocks + phase + 1u]) return;
  MeetStrips(models[cloth.model.strip_blocks + block], models[cloth.model.strip_blocks + block + 1u], sweep == 0u);
#else
  uint strip = models[cloth.model.strip_phases + phase] + gl_GlobalInvocationID.x;
  uint end = models[cloth.model.strip_phases + phase + 1u];
  if (strip < end) SolveStrip(strip, sweep == 0u);
#endif
}
