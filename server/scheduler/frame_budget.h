// A frame budget as a cap on sweeps: iterating may stop at any time with what it has (Bender et al.
// 2009, section 3.5).
#pragma once

#include <cstdint>

#include "server/solver/step_report.h"
#include "server/solver/step_settings.h"

namespace drape {

// The budget of one cloth. The cost of a sweep is learnt from the cloth's own steps: the wall time
// of the whole Backend::Step that it takes part in, including the other cloths of the batch,
// because that is how long its client waits. Device thread.
class FrameBudget {
 public:
  // Forgets the measurements if the settings change.
  void Set(const StepSettings& settings);
  // As set.
  const StepSettings& settings() const { return settings_; }

  // What was learnt; 0: nothing yet.
  double sweep_us() const { return sweep_us_; }
  void Restore(const StepSettings& settings, double sweep_us) {
    settings_ = settings;
    sweep_us_ = sweep_us;
  }

  // Limit on the sweeps per substep of the next step: as many as fit into the budget, at least one,
  // at most the settings' max_iterations; one until a step has been measured. 0 without a budget.
  uint32_t Cap() const;

  // A step with Cap() took `step_us`. Returns its report with the cap and, if a single sweep per
  // substep takes longer than the budget, the warning. Returns the report unchanged if there is no
  // budget or the step was not done.
  StepReport Measured(StepReport report, double step_us);

 private:
  // How many sweeps per substep fit into the budget, as a fraction.
  double SweepsThatFit() const;

  StepSettings settings_;
  // Smoothed time of one sweep in every substep [us]; 0: not measured yet.
  double sweep_us_ = 0;
};

}  // namespace drape
