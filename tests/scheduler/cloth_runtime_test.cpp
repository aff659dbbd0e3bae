#include "server/scheduler/cloth_runtime.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/scheduler/fake_backend.h"
#include "tests/support/plain_settings.h"

namespace drape {
namespace {

std::shared_ptr<ClothRuntime> AtWork(double time_step_s) {
  auto cloth = std::make_shared<ClothRuntime>();
  StepSettings settings = test::PlainSettings();
  settings.time_step_s = time_step_s;
  cloth->Begin({3, 1}, ChainModel(2), settings, {10, 100}, {}, {});
  return cloth;
}

TEST(ClothRuntime, TimeIsExactlyStepsTimesTimeStep) {
  const auto cloth = AtWork(1.0 / 60);
  for (int step = 1; step <= 1000; ++step) {
    cloth->CompleteStep({});
    ASSERT_EQ(cloth->now().time_s, step * (1.0 / 60));
  }
  EXPECT_EQ(cloth->now().completed_steps, 1000u);
  EXPECT_EQ(cloth->NextTime_s(), 1001 * (1.0 / 60));
}

TEST(ClothRuntime, ANewTimeStepCountsFromNowOn) {
  const auto cloth = AtWork(0.5);
  cloth->CompleteStep({});
  cloth->CompleteStep({});
  StepSettings slower = test::PlainSettings();
  slower.time_step_s = 0.25;
  cloth->SetSettings(slower);
  cloth->CompleteStep({});
  EXPECT_EQ(cloth->now().time_s, 1.25);
  EXPECT_EQ(cloth->now().completed_steps, 3u);
}

TEST(ClothRuntime, AFaultStopsTheClockAndKeepsTheState) {
  const auto cloth = AtWork(0.5);
  cloth->CompleteStep({});
  const uint64_t version = cloth->state_version();
  StepReport report;
  report.fault = FaultReason::kRunaway;
  report.warnings.not_converged = true;
  cloth->CompleteStep(report);
  EXPECT_EQ(cloth->now().completed_steps, 1u);
  EXPECT_EQ(cloth->now().time_s, 0.5);
  EXPECT_EQ(cloth->now().fault, FaultReason::kRunaway);
  EXPECT_EQ(cloth->state_version(), version);
  EXPECT_EQ(cloth->progress().fault, FaultReason::kRunaway);
}

TEST(ClothRuntime, ResetBeginsAgainAndCountsAsAChangeOfState) {
  const auto cloth = AtWork(0.5);
  StepReport report;
  report.warnings = {.tolerance_raised = true,
                     .not_converged = true,
                     .springs_beyond_limit = true,
                     .elastic_beyond_limit = true,
                     .energy_gained = true,
                     .springs_gain_energy = true,
                     .over_budget = true,
                     .strain_beyond_limit = true,
                     .starts_crossing = true,
                     .contacts_given_up = true};
  cloth->CompleteStep(report);
  EXPECT_EQ(cloth->progress().warnings, (WarningCounters{1, 1, 1, 1, 1, 1, 1, 1, 1, 1}));
  const uint64_t version = cloth->state_version();
  cloth->Reset({}, {});
  EXPECT_EQ(cloth->progress().completed_steps, 0u);
  EXPECT_EQ(cloth->progress().time_s, 0);
  EXPECT_EQ(cloth->progress().warnings, WarningCounters{});
  EXPECT_GT(cloth->state_version(), version);
  cloth->CompleteStep({});
  EXPECT_EQ(cloth->progress().time_s, 0.5);
}

// Each step is told what those before it have added.
TEST(ClothRuntime, KeepsTheBalanceOfEnergy) {
  const auto cloth = AtWork(0.5);
  const auto gain_j = [&] { return cloth->energy().gain_j; };
  EXPECT_EQ(cloth->energy().scale_j, 0);
  StepReport report;
  report.energy = EnergyBalance{.gain_j = 0.25, .scale_j = 1};
  cloth->CompleteStep(report);
  EXPECT_EQ(gain_j(), 0.25);
  EXPECT_EQ(cloth->energy().scale_j, 1);
  const RuntimeState saved = cloth->Save();
  cloth->CompleteStepAsleep();
  EXPECT_EQ(gain_j(), 0.25);
  cloth->CompleteStep({});
  EXPECT_EQ(gain_j(), 0) << "something acts";
  cloth->Restore(saved);
  EXPECT_EQ(gain_j(), 0.25);
  cloth->Restate();
  EXPECT_EQ(gain_j(), 0);
  cloth->Restore(saved);
  cloth->Reset({}, {});
  EXPECT_EQ(gain_j(), 0);
}

TEST(ClothRuntime, ReportsAreShiftedToTheClientsFrames) {
  StepReport report;
  report.measured.lowest_m = 1;
  report.measured.potential_energy_j = 2;
  const StepReport shifted = AtWork(1)->Shifted(report);
  EXPECT_EQ(shifted.measured.lowest_m, 11);
  EXPECT_EQ(shifted.measured.potential_energy_j, 102);
}

TEST(PublishedProgress, AReaderNeverSeesValuesOfTwoMoments) {
  PublishedProgress published;
  constexpr uint64_t kMoments = 200000;
  std::thread writer([&] {
    for (uint64_t n = 1; n <= kMoments; ++n) {
      published.Publish({n, static_cast<double>(n), FaultReason::kNone, {n, n, n, n, n}});
    }
  });
  uint64_t last = 0;
  while (last < kMoments) {
    const ClothProgress seen = published.Read();
    ASSERT_EQ(seen.time_s, static_cast<double>(seen.completed_steps));
    const uint64_t n = seen.completed_steps;
    ASSERT_EQ(seen.warnings, (WarningCounters{n, n, n, n, n}));
    ASSERT_GE(seen.completed_steps, last);
    last = seen.completed_steps;
  }
  writer.join();
}

}  // namespace
}  // namespace drape
