// Kernel `tiled_elastic_impulses`: stage apply_elastic, first phase. One invocation = one elastic element.
// Reads Models, Scratch (positions, velocities); writes Scratch (impulses [N s]).
#include "stages/access_tiled.glsl"
#include "stages/apply_elastic.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;
layout(location = DRAPE_UNIFORM_KICK_PLACE) uniform uint place;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  uint e = gl_GlobalInvocationID.x;
  if (e >= cloth.elastic_count || substep_index >= cloth.step.substeps) return;
  BeginSubstep(substep_index);
  float seconds = KickSeconds(place);
  if (seconds != 0.0) StoreElasticImpulse(e, place, seconds);
}
