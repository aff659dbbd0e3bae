// Kernel `measure_total`: stage measure, second phase, for cloths of several pieces: merges the pieces in a
// fixed order. Work group = cloth. Reads Scratch (pieces); writes Statuses.
#include "stages/measured.glsl"

layout(local_size_x = LOCAL_SIZE) in;

void main() {
  BatchItem item = items[first_item + gl_WorkGroupID.x];
  OpenRecord(item.cloth);
  if (cloth.measure_piece_count <= 1u) return;
  Measured measured = NothingMeasured();
  for (uint piece = gl_LocalInvocationID.x; piece < cloth.measure_piece_count;
       piece += LOCAL_SIZE) {
    measured = MergeMeasured(measured, LoadPiece(piece));
  }
  measured = MergeInvocations(measured);
  if (gl_LocalInvocationID.x == 0u) StoreMeasured(item.status, measured);
}
