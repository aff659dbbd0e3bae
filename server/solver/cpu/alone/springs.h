// Stage `apply_springs`: springs by half kicks or in the force of the substep.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// Changes the velocities of the scratch state by what springs do within `duration` [s]; nothing if
// they are in the force.
void ApplySprings(const StepContext& context, const Vec4* positions, float duration);

// The accelerations g + A(p, v) of the substep; nothing unless springs are in its force.
void AccelerateBySprings(const StepContext& context);

}  // namespace drape::cpu
