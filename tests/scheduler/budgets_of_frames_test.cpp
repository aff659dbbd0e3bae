// Frame budgets in the rounds of the device loop.
#include <gtest/gtest.h>

#include <vector>

#include "tests/scheduler/device_loop_fixture.h"

namespace drape {
namespace {

class BudgetsOfFramesTest : public DeviceLoopTest {};

// Two cloths that take 0.25 ms together: the one with a budget of 1 ms gets one sweep, and then
// as many as fit if they all cost as much.
TEST_F(BudgetsOfFramesTest, AFrameBudgetCapsTheSweepsOfItsCloth) {
  const auto a = Cloth(), b = Cloth();
  StepSettings settings = test::PlainSettings();
  settings.substeps = 1;
  settings.max_iterations = 100;
  settings.frame_budget_ms = 1;
  b->SetSettings(settings);
  device_->OnStep([this] { clock_.AdvanceUs(250); });
  StepWork work = Work("x", {a, b}, 2);
  work.report = true;
  Admit(std::move(work));
  RunAll();
  const std::vector<FakeBatch> batches = device_->batches();
  ASSERT_EQ(batches.size(), 2u);
  EXPECT_EQ(batches[0][0].max_iterations, 0u) << "no budget";
  EXPECT_EQ(batches[0][1].max_iterations, 1u);
  EXPECT_EQ(batches[1][0].max_iterations, 0u);
  EXPECT_EQ(batches[1][1].max_iterations, 4u);
  const StepOutcome& outcome = outcomes_.at("x");
  EXPECT_EQ(outcome.cloths[0].report->iteration_cap, 0u);
  EXPECT_EQ(outcome.cloths[1].report->iteration_cap, 4u);
  EXPECT_EQ(outcome.cloths[1].warnings.over_budget, 0u);
}

TEST_F(BudgetsOfFramesTest, ABudgetBelowOneSweepIsCounted) {
  const auto cloth = Cloth();
  StepSettings settings = test::PlainSettings();
  settings.substeps = 1;
  settings.frame_budget_ms = 0.1;
  cloth->SetSettings(settings);
  device_->OnStep([this] { clock_.AdvanceUs(250); });
  Admit(Work("x", {cloth}, 3));
  RunAll();
  EXPECT_EQ(outcomes_.at("x").cloths[0].warnings.over_budget, 3u);
  EXPECT_EQ(device_->batches().back()[0].max_iterations, 1u);
}

}  // namespace
}  // namespace drape
