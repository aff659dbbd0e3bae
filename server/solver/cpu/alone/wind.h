// Stage `apply_wind`: drag and lift of the air on the triangles.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// Changes the velocities of the scratch state by what the air does within `duration` [s].
void ApplyWind(const StepContext& context, const Vec4* positions, float duration);

}  // namespace drape::cpu
