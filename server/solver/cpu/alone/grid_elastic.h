// Stage `apply_elastic` of a grid, eight columns side by side.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// `positions`: of all particles; null: b + H u of the substep under way.
void ApplyGridElastic(const StepContext& context, const Vec4* positions, float duration);

}  // namespace drape::cpu
