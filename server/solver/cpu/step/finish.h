// The end of a step, for both paths.
#pragma once

#include "server/solver/cpu/step/step_context.h"
#include "server/solver/step_report.h"

namespace drape::cpu {

// What is left to do for a step.
enum class Ending {
  kDone,
  // Colliders were left out that may have been touched: it is to be done again with all of them
  // (ColliderReach).
  kWithAllColliders,
  // It gained energy: it is to be done again with context.calmer_controls.
  kCalmer,
};

// The end of a step: the new state of context.scratch replaces `state` unless it has blown up or
// the step is to be done again, and the report gets what there is to tell. `may_have_fault`: only
// then it is looked for.
Ending Finish(const StepContext& context, bool may_have_fault, bool measure, FloatState& state,
              StepReport& report);

}  // namespace drape::cpu
