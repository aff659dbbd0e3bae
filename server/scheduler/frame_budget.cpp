#include "server/scheduler/frame_budget.h"

#include <algorithm>

namespace drape {
namespace {

// Weight of a new measurement in the smoothed one [-]. Rising costs count quickly, so that a
// machine that becomes busy exceeds the budget for a few steps only; falling costs count slowly, so
// that one quick step does not use up the budget of the next.
constexpr double kShareOfRise = 0.5;
constexpr double kShareOfFall = 0.1;

}  // namespace

void FrameBudget::Set(const StepSettings& settings) {
  if (settings == settings_) return;
  settings_ = settings;
  sweep_us_ = 0;
}

double FrameBudget::SweepsThatFit() const {
  return settings_.frame_budget_ms * 1000 / sweep_us_;
}

uint32_t FrameBudget::Cap() const {
  if (settings_.frame_budget_ms == 0) return 0;
  if (sweep_us_ == 0) return 1;
  return static_cast<uint32_t>(
      std::clamp(SweepsThatFit(), 1.0, static_cast<double>(settings_.max_iterations)));
}

StepReport FrameBudget::Measured(StepReport report, double step_us) {
  if (settings_.frame_budget_ms == 0 || report.iterations == 0) return report;
  report.iteration_cap = Cap();
  // A step that met its tolerance made fewer sweeps than the cap.
  const double sweeps = std::min(static_cast<double>(report.iterations) / settings_.substeps,
                                 static_cast<double>(report.iteration_cap));
  const double measured_us = std::max(step_us, 1.0) / sweeps;
  const double share = measured_us > sweep_us_ ? kShareOfRise : kShareOfFall;
  sweep_us_ = sweep_us_ == 0 ? measured_us : sweep_us_ + share * (measured_us - sweep_us_);
  report.warnings.over_budget = SweepsThatFit() < 1;
  return report;
}

}  // namespace drape
