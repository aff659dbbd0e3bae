// Kernel `tiled_find_range`: stage find_reach, first phase: between which places the free particles are, how
// fast the fastest one is, how far pins go. Work group x = piece of DRAPE_MEASURE_PIECE particles and as many
// pins, y = cloth. Reads Scratch (positions [m], velocities [m/s]), Models, Parameters; writes Statuses (range).
#include "stages/access_tiled.glsl"
#include "stages/find_reach.glsl"

layout(local_size_x = LOCAL_SIZE) in;

void SharedBarrier() {
  memoryBarrierShared();
  barrier();
}

void main() {
  OpenCloth(gl_WorkGroupID.y);
  ClearSharedRange();
  SharedBarrier();
  uint begin = gl_WorkGroupID.x * DRAPE_MEASURE_PIECE;
  uint particle_end = min(begin + DRAPE_MEASURE_PIECE, cloth.particle_count);
  uint pin_end = min(begin + DRAPE_MEASURE_PIECE, cloth.pin_count);
  Spread spread = NoSpread();
  uint first = begin + gl_LocalInvocationID.x;
  for (uint i = first; i < particle_end; i += LOCAL_SIZE) SpreadOver(i, spread);
  for (uint k = first; k < pin_end; k += LOCAL_SIZE) SpreadOverPin(k, spread);
  AddToSharedRange(spread);
  SharedBarrier();
  if (gl_LocalInvocationID.x != 0u) return;
  for (int k = 0; k < DRAPE_RANGE_WORDS; ++k) {
    atomicMax(statuses[status_index].range[k], shared_range[k]);
  }
}
