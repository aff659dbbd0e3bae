// Stage `apply_elastic`: the elements of bending and shear.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// Changes the velocities of the scratch state by what the elastic elements do within `duration`
// [s].
void ApplyElastic(const StepContext& context, const Vec4* positions, float duration);

}  // namespace drape::cpu
