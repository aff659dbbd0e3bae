// Stage `tether`.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// No particle ends the substep farther from a pin than the cloth between them is long
// (scene/tethers.h).
void Tether(const StepContext& context);

}  // namespace drape::cpu
