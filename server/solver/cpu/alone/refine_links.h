// Stage `refine` of one cloth.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// Moves the links that exceed the limits after the strips, and those at their ends, to their
// lengths, one by one.
void RefineLinks(const StepContext& context);

}  // namespace drape::cpu
