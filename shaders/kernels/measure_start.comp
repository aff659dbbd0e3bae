// Kernel `measure_start`: stage measure, before a step that is measured: keeps the positions. x: piece, y: cloth.
// Reads States; writes Scratch.
#include "stages/buffers.glsl"

layout(local_size_x = LOCAL_SIZE) in;

void main() {
  OpenRecord(items[first_item + gl_WorkGroupID.y].cloth);
  uint begin = gl_WorkGroupID.x * DRAPE_MEASURE_PIECE;
  uint end = min(begin + DRAPE_MEASURE_PIECE, cloth.particle_count);
  for (uint i = begin + gl_LocalInvocationID.x; i < end; i += LOCAL_SIZE) {
    SetScratchVector(cloth.scratch.start_positions + 3u * i, StateVector(cloth.positions + 3u * i));
  }
}
