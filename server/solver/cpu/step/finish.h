// The end of a step, for both paths.
#pragma once

#include "server/solver/cpu/step/step_context.h"
#include "server/solver/step_report.h"

namespace drape::cpu {

// The end of a step: the new state of context.scratch replaces `state` unless it has blown up,
// and the report gets what there is to tell. `may_have_fault`: only then it is looked for. False:
// nothing is done, as colliders were left out that may have been touched; the step is to be done
// again with all (ColliderReach).
bool Finish(const StepContext& context, bool may_have_fault, bool measure, FloatState& state,
            StepReport& report);

}  // namespace drape::cpu
