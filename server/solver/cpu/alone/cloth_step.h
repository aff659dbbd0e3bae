// The step of one cloth, or of a world (server/solver/method.md), stage by stage.
#pragma once

#include <cstdint>
#include <vector>

#include "server/solver/cpu/alone/stepped_cloth.h"
#include "server/solver/pause.h"
#include "server/solver/step_report.h"

namespace drape::cpu {

// Of one cloth in a step.
struct StepOfCloth {
  bool is_sweeping = true;   // in the substep under way
  bool has_changed = false;  // something in the last sweep
  StepReport report{};
};

// How far a step is that is done in pieces. All else is in the StepScratch of each cloth, which it
// must find as it left it; context.substep is set again.
struct StepProgress {
  // The part of the substep that comes next.
  enum class Part { kBeforeSweeps, kSweeps, kVelocitySweeps };

  bool is_calmer = false;  // it has gained energy and is done again with context.calmer_controls
  bool has_reach = false;  // the colliders in reach are known
  bool has_begun = false;  // scratch.state is the working copy
  uint32_t substep = 0;    // under way
  Part part = Part::kBeforeSweeps;
  uint32_t sweep = 0;                 // of the part
  std::vector<StepOfCloth> cloths{};  // of each, once it has begun
};

// Steps `state` once, by the calling thread as the leader of context.team. If it blows up, `state`
// stays as it was and the report says why. The result is a function of model, controls, pin targets
// and state alone: within a stage ranges depend on each other in nothing. Thread-safe for different
// states.
StepReport StepCloth(StepContext context, bool measure, FloatState& state);

// The same for one cloth, or for all of a world in its order, in pieces and with the same bits:
// begins or goes on until `pause` is due. False: it paused, and the states are as before; else
// progress.cloths has the reports. The contexts of each piece differ only in team and thread; those
// of a world have the same time step, substeps, integration, team and most sweeps, and the surface
// of the world. If one cloth blows up, all states stay as they were. A step that gained energy is
// done again for all.
bool ContinueStep(SteppedCloths cloths, StepProgress& progress, const Pause& pause);

// The same with context.calmer_controls, for a step that has gained energy, and its warning.
StepReport StepCalmer(const StepContext& context, bool measure, FloatState& state);

}  // namespace drape::cpu
