// The step of one cloth (server/solver/method.md), stage by stage.
#pragma once

#include <cstdint>
#include <optional>

#include "server/solver/cpu/step/step_context.h"
#include "server/solver/pause.h"
#include "server/solver/step_report.h"

namespace drape::cpu {

// How far a step is that is done in pieces. All else is in its StepScratch, which it must find as
// it left it; context.substep is set again.
struct StepProgress {
  // The part of the substep that comes next.
  enum class Part { kBeforeSweeps, kSweeps, kVelocitySweeps };

  bool is_calmer = false;  // it has gained energy and is done again with context.calmer_controls
  bool has_reach = false;  // the colliders in reach are known
  bool has_begun = false;  // scratch.state is the working copy
  uint32_t substep = 0;    // under way
  Part part = Part::kBeforeSweeps;
  uint32_t sweep = 0;  // of the part
  StepReport report{};
};

// Steps `state` once, by the calling thread as the leader of context.team. If it blows up, `state`
// stays as it was and the report says why. The result is a function of model, controls, pin targets
// and state alone: within a stage ranges depend on each other in nothing. Thread-safe for different
// states.
StepReport StepCloth(StepContext context, bool measure, FloatState& state);

// The same in pieces, with the same bits: begins or goes on until `pause` is due; none: it paused,
// and `state` is as before. The context of each piece differs only in team and thread.
std::optional<StepReport> ContinueStep(StepContext context, bool measure, FloatState& state,
                                       StepProgress& progress, const Pause& pause);

// The same with context.calmer_controls, for a step that has gained energy, and its warning.
StepReport StepCalmer(const StepContext& context, bool measure, FloatState& state);

}  // namespace drape::cpu
