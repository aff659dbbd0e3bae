// The cloths of one step: one, or those of a world in the order of their world.
#pragma once

#include <span>

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

struct SteppedCloth {
  StepContext context;
  bool measure = false;
  FloatState& state;
};

using SteppedCloths = std::span<SteppedCloth>;

}  // namespace drape::cpu
