// Kernel `tiled_watch_energy`: stage commit, before its other phases: whether the step gave the cloth more energy
// than it may. One work group = one cloth; an invocation takes every LOCAL_SIZE-th sum. Reads States, Scratch, Models,
// Parameters; writes Statuses (gained_energy).
#include "stages/access_tiled.glsl"

layout(local_size_x = LOCAL_SIZE) in;

#define ENERGY_SUMS DRAPE_TILED_ENERGY_SUMS
shared vec2 energy_sums[ENERGY_SUMS];

void SetEnergySum(uint s, vec2 sum) { energy_sums[s] = sum; }
vec2 EnergySum(uint s) { return energy_sums[s]; }
// One of the kernels of the tiled plan that have phases of their own.
void EndSumPhase() {
  memoryBarrierShared();
  barrier();
}

#include "stages/watch_energy.glsl"

void main() {
  OpenCloth(gl_WorkGroupID.y);
  bool gains_energy = GainsEnergy();
  if (gl_LocalInvocationID.x == 0u) statuses[status_index].gained_energy = gains_energy ? 1u : 0u;
}
