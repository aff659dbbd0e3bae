// Stages `apply_elastic` and `solve_hinges`: the elements of bending and shear by their forces.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// Changes the velocities of the scratch state by what the elastic elements do within `duration`
// [s].
void ApplyElastic(const StepContext& context, const Vec4* positions, float duration);

// Changes u by what they do until the end of the substep.
void SolveHinges(const StepContext& context);

}  // namespace drape::cpu
