// Stage `solve_elastic`: the elements of bending and shear line by line.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

void SolveElastic(const StepContext& context);

}  // namespace drape::cpu
