// Stage `refine` of one cloth.
#pragma once

#include "server/solver/cpu/cloth_step.h"

namespace drape::cpu {

// Links that strips have left far off, and those at their ends, one by one.
void RefineLinks(const StepContext& context);

}  // namespace drape::cpu
