#include "server/scheduler/frame_budget.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/plain_settings.h"

namespace drape {
namespace {

StepSettings Budgeted(double frame_budget_ms, uint32_t max_iterations = 100,
                      uint32_t substeps = 1) {
  StepSettings settings = test::PlainSettings();
  settings.substeps = substeps;
  settings.max_iterations = max_iterations;
  settings.frame_budget_ms = frame_budget_ms;
  return settings;
}

// A device on which a step takes a fixed time plus a time per sweep.
struct Device {
  double step_us = 50;
  double sweep_us = 100;

  double TimeOf(uint32_t sweeps) const { return step_us + sweep_us * sweeps; }
};

// One step that uses all that it may; returns its report.
StepReport Step(FrameBudget& budget, const Device& device, uint32_t substeps = 1) {
  StepReport report;
  report.iterations = substeps * budget.Cap();
  return budget.Measured(report, device.TimeOf(report.iterations));
}

TEST(FrameBudget, WithoutOneNothingIsCapped) {
  FrameBudget budget;
  budget.Set(Budgeted(0));
  EXPECT_EQ(budget.Cap(), 0u);
  StepReport report;
  report.iterations = 100;
  EXPECT_EQ(budget.Measured(report, 1e9).iteration_cap, 0u);
  EXPECT_FALSE(budget.Measured(report, 1e9).warnings.over_budget);
  EXPECT_EQ(budget.Cap(), 0u);
}

// The fixed part of a step makes sweeps seem more expensive while there are few of them, so the cap
// rises from below and no step exceeds the budget by more than a sweep.
TEST(FrameBudget, ComesFromOneSweepToAsManyAsFit) {
  FrameBudget budget;
  budget.Set(Budgeted(2));
  const Device device;
  EXPECT_EQ(budget.Cap(), 1u);
  for (int step = 0; step < 100; ++step) {
    const StepReport report = Step(budget, device);
    EXPECT_EQ(report.iteration_cap, report.iterations);
    EXPECT_FALSE(report.warnings.over_budget);
    EXPECT_LE(device.TimeOf(report.iterations), 2000 + device.sweep_us) << step;
  }
  // (2000 - 50) / 100 sweeps fit.
  EXPECT_EQ(budget.Cap(), 19u);
}

TEST(FrameBudget, NeverMoreThanTheSettingsAllow) {
  FrameBudget budget;
  budget.Set(Budgeted(1000, 7));
  for (int step = 0; step < 10; ++step) Step(budget, Device());
  EXPECT_EQ(budget.Cap(), 7u);
}

TEST(FrameBudget, SweepsCountPerSubstep) {
  FrameBudget budget;
  budget.Set(Budgeted(2, 100, 4));
  const Device device{.step_us = 0, .sweep_us = 100};
  for (int step = 0; step < 10; ++step) Step(budget, device, 4);
  EXPECT_EQ(budget.Cap(), 5u) << "4 substeps of 5 sweeps of 0.1 ms";
}

TEST(FrameBudget, OneSweepThatTakesTooLongIsDoneAndSaid) {
  FrameBudget budget;
  budget.Set(Budgeted(0.1));
  for (int step = 0; step < 3; ++step) {
    const StepReport report = Step(budget, Device());
    EXPECT_EQ(report.iteration_cap, 1u);
    EXPECT_TRUE(report.warnings.over_budget);
  }
}

// Four times as expensive from one step to the next: each step takes over half of the difference.
TEST(FrameBudget, ADeviceThatGetsBusyIsBelievedSoon) {
  FrameBudget budget;
  budget.Set(Budgeted(10));
  for (int step = 0; step < 100; ++step) Step(budget, {.step_us = 0, .sweep_us = 100});
  EXPECT_EQ(budget.Cap(), 100u);
  const Device busy{.step_us = 0, .sweep_us = 400};
  for (int step = 0; step < 10; ++step) Step(budget, busy);
  // 400 - 300 / 2^10 us.
  EXPECT_LE(busy.TimeOf(budget.Cap()), 10000 + busy.sweep_us);
  EXPECT_GE(budget.Cap(), 25u);
}

// A cloth that met its tolerance after 2 of 50 sweeps gives the cost of 2 sweeps, not of 50.
TEST(FrameBudget, StepsThatConvergeEarlyDoNotMakeSweepsCheap) {
  FrameBudget budget;
  budget.Set(Budgeted(5));
  const Device device{.step_us = 0, .sweep_us = 100};
  for (int step = 0; step < 20; ++step) {
    StepReport report;
    report.iterations = std::min(budget.Cap(), 2u);
    budget.Measured(report, device.TimeOf(report.iterations));
  }
  EXPECT_EQ(budget.Cap(), 50u);
}

TEST(FrameBudget, OnlyOtherSettingsForgetWhatWasMeasured) {
  FrameBudget budget;
  budget.Set(Budgeted(2));
  for (int step = 0; step < 10; ++step) Step(budget, Device());
  const uint32_t cap = budget.Cap();
  EXPECT_GT(cap, 1u);
  budget.Set(Budgeted(2));
  EXPECT_EQ(budget.Cap(), cap);
  budget.Set(Budgeted(4));
  EXPECT_EQ(budget.Cap(), 1u);
}

// A faulted cloth is not stepped: nothing to learn.
TEST(FrameBudget, StepsThatWereNotDoneAreNotMeasured) {
  FrameBudget budget;
  budget.Set(Budgeted(2));
  StepReport report;
  report.fault = FaultReason::kRunaway;
  EXPECT_EQ(budget.Measured(report, 1).iteration_cap, 0u);
  EXPECT_EQ(budget.Cap(), 1u);
}

}  // namespace
}  // namespace drape
