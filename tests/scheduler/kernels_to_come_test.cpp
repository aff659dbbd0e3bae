// Requests that wait for what their device compiles (DeviceBackend::IsReadyToMeasure).
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/scheduler/device_loop_fixture.h"

namespace drape {
namespace {

class KernelsToComeTest : public DeviceLoopTest {};

TEST_F(KernelsToComeTest, WhoWaitsForKernelsHoldsUpNobodyElse) {
  const auto a = Cloth(), b = Cloth();
  device_->SetReadyToTell(false);
  StepWork asks = Work("asks", {a});
  asks.impulses = true;
  Admit(std::move(asks));
  Admit(Work("behind it", {a}));
  Admit(Work("other", {b}, 2));
  loop_->RunRound();
  EXPECT_EQ(loop_->RestUntil_us(), std::nullopt);
  loop_->RunRound();
  EXPECT_EQ(ended_, std::vector<std::string>{"other"});
  EXPECT_EQ(loop_->RestUntil_us(), clock_.NowUs() + DeviceLoop::kLookForKernels_us);
  EXPECT_EQ(loop_->RunRound(), std::nullopt);
  device_->SetReadyToTell(true);
  RunAll();
  EXPECT_EQ(ended_, (std::vector<std::string>{"other", "asks", "behind it"}));
}

TEST_F(KernelsToComeTest, WhoWaitsForKernelsMayGiveUp) {
  const auto a = Cloth();
  device_->SetReadyToMeasure(false);
  StepWork asks = Work("asks", {a});
  asks.report = true;
  asks.deadline_us = clock_.NowUs() + 5000;
  Admit(std::move(asks));
  loop_->RunRound();
  EXPECT_TRUE(loop_->has_requests());
  clock_.AdvanceUs(5000);
  loop_->RunRound();
  EXPECT_EQ(outcomes_.at("asks").status.reason(), "DEADLINE_PASSED");
}

}  // namespace
}  // namespace drape
