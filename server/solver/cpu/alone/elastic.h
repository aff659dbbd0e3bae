// Stage `apply_elastic`: the elements of bending and shear.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// Changes the velocities of the scratch state by what the elastic elements do within `duration`
// [s]. The model must have some.
void ApplyElastic(const StepContext& context, const Lanes* positions, float duration);

}  // namespace drape::cpu
