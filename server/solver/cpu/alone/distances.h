// Stages `solve_distance` and `solve_velocity` of distance constraints, colour by colour.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// One sweep over all colours. Returns whether an error was larger than the tolerance.
bool SolveDistance(const StepContext& context);

// One sweep over the rigid equalities.
void SolveDistanceVelocities(const StepContext& context);

}  // namespace drape::cpu
