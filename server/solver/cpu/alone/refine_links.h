// Stage `refine` of one cloth.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// Moves the links that strips have left far off, and those at their ends, to their lengths, one by
// one.
void RefineLinks(const StepContext& context);

}  // namespace drape::cpu
