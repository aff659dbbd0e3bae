// Stage `advance_lengths`: rest lengths of a cloth's own (server/solver/method.md).
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// The lengths at the end of this substep into the scratch memory. Needs own lengths.
void AdvanceLengths(const StepContext& context);

}  // namespace drape::cpu
