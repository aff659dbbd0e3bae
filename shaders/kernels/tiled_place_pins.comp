// Kernel `tiled_place_pins`: the end of the last substep, where each pin is put exactly on its target. One
// invocation = one pin. Reads Models, Parameters; writes Scratch (positions [m]).
#include "stages/access_tiled.glsl"
#include "stages/predict.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;

void main() {
  OpenCloth(gl_WorkGroupID.y);
  uint k = gl_GlobalInvocationID.x;
  if (substep_index + 1u == cloth.step.substeps && k < cloth.pin_count) PlacePin(k);
}
