// Stage `solve_strips`: all constraints of a path at once, eight paths side by side.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// One sweep over all strips, phase by phase (server/solver/method.md). Returns whether the errors
// of any were larger than the tolerance.
bool SolveStrips(const StepContext& context);

}  // namespace drape::cpu
