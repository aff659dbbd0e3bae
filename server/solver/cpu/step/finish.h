// The end of a step, for both paths.
#pragma once

#include <span>

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

// One of the cloths whose step ends.
struct EndingCloth {
  const StepContext& context;
  FloatState& state;
  bool may_have_fault = false;  // only then it is looked for
  bool measure = false;
  StepReport& report;
};

// The end of a step of one cloth, or of all cloths of a world: the new states of their scratch
// memory replace `state`, unless one has blown up or the step is to be done again, and the reports
// get what there is to tell.
Ending Finish(std::span<const EndingCloth> cloths);

}  // namespace drape::cpu
