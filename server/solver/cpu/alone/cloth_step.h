// The step of one cloth (server/solver/method.md), stage by stage.
#pragma once

#include "server/solver/cpu/step/step_context.h"
#include "server/solver/step_report.h"

namespace drape::cpu {

// Steps `state` once, by the calling thread as the leader of context.team. If it blows up, `state`
// stays as it was and the report says why. The result is a function of model, controls, pin targets
// and state alone: within a stage ranges depend on each other in nothing. Thread-safe for different
// states.
StepReport StepCloth(StepContext context, bool measure, FloatState& state);

// The same with context.calmer_controls, for a step that has gained energy, and its warning.
StepReport StepCalmer(const StepContext& context, bool measure, FloatState& state);

}  // namespace drape::cpu
