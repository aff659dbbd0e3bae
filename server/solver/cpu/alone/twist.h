// Stage `damp_twist`.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// Every cell of the grid gives its corners a share of its twist back (server/solver/method.md), all
// from the same velocities u.
void DampTwist(const StepContext& context);

}  // namespace drape::cpu
