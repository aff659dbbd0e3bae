// Kernel `tiled_check`: stage commit, first phase: looks for a particle beyond the limits. One invocation =
// one particle. Reads Scratch; writes Statuses (fault).
#include "stages/access_tiled.glsl"
#include "lib/fault.glsl"

layout(local_size_x = LOCAL_SIZE) in;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  uint i = gl_GlobalInvocationID.x;
  if (i >= cloth.particle_count) return;
  uint fault = FaultOf(Position(i), Velocity(i));
  if (fault != 0u) atomicOr(statuses[status_index].fault, fault);
}
