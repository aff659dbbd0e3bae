// A frame budget as a cap on sweeps: iterating may stop at any time with what it has (Bender et al.
// 2009, section 3.5).
#pragma once

#include <cstdint>

#include "server/solver/step_report.h"
#include "server/solver/step_settings.h"

namespace drape {

// Of one cloth. What a sweep costs is learnt from its own steps: the wall time of the whole
// Backend::Step that the cloth takes part in, the share of all others in the batch included,
// because that is what its client waits for. Device thread.
class FrameBudget {
 public:
  // Forgets what was measured if the settings that it belongs to change.
  void Set(const StepSettings& settings);
  // As set.
  const StepSettings& settings() const { return settings_; }

  // Sweeps per substep that the next step may have: as many as fit into the budget, at least one,
  // at most the settings' max_iterations; one as long as nothing is measured. 0 without a budget.
  uint32_t Cap() const;

  // Takes in a step that was done with Cap() and returns its report with the cap and, where one
  // sweep per substep takes longer than the budget, the warning. Leaves reports of cloths without
  // budget, and of steps that were not done, as they are.
  StepReport Measured(StepReport report, double step_us);

 private:
  // How many sweeps per substep fit, as a fraction.
  double Room() const;

  StepSettings settings_;
  // Of one sweep in every substep [us], smoothed; 0: not measured yet.
  double sweep_us_ = 0;
};

}  // namespace drape
