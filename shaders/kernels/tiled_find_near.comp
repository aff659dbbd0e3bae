// Kernel `tiled_find_near`: stage find_reach, second phase: which colliders nothing touches in the range. One
// invocation = one collider that may be left out. Reads Parameters, Models, Statuses (range); writes Statuses
// (far_colliders).
#include "stages/access_tiled.glsl"
#include "stages/find_reach.glsl"

layout(local_size_x = LOCAL_SIZE) in;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  uint c = gl_GlobalInvocationID.x;
  if (c >= min(cloth.collider_count, DRAPE_LEFT_OUT_COLLIDERS)) return;
  range = RangeFrom(statuses[status_index].range);
  if (!MayMeet(c)) atomicOr(statuses[status_index].far_colliders, SetOf(c));
}
