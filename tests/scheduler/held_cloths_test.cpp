// Cloths that commands hold, as the device loop sees them.
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "tests/scheduler/device_loop_fixture.h"

namespace drape {
namespace {

using HeldClothsTest = DeviceLoopTest;

TEST_F(HeldClothsTest, ClothsThatAreHeldAreNotStepped) {
  const auto a = Cloth(), b = Cloth(), c = Cloth();
  Admit(Work("running", {a, b}, 3));
  loop_->RunRound();
  a->Hold();
  Admit(Work("waiting", {c, a}, 1));
  StepWork other = Work("other", {c}, 1);
  c->Hold();  // by somebody else
  Admit(other);
  for (int round = 0; round < 3; ++round) EXPECT_EQ(loop_->RunRound(), std::nullopt);
  EXPECT_GT(loop_->RestUntil_us().value_or(0), clock_.NowUs()) << "it waits without turning";
  EXPECT_EQ(a->now().completed_steps, 1u);
  c->Release();
  loop_->RunRound();
  EXPECT_EQ(c->now().completed_steps, 0u) << "behind a request that waits for the other cloth";
  a->Release();
  EXPECT_EQ(loop_->RestUntil_us(), std::nullopt);
  RunAll();
  EXPECT_EQ(ended_, (std::vector<std::string>{"running", "waiting", "other"}));
  EXPECT_EQ(a->now().completed_steps, 4u);
}

TEST_F(HeldClothsTest, AHeldRequestCanBeCancelled) {
  const auto a = Cloth();
  StepWork work = Work("x", {a}, 3);
  const CancelToken cancel = work.cancel;
  Admit(work);
  loop_->RunRound();
  a->Hold();
  CancelToken(cancel).Cancel();
  loop_->RunRound();
  EXPECT_EQ(outcomes_["x"].status.reason(), "CANCELLED");
  a->Release();
  Admit(Work("y", {a}, 1));
  RunAll();
  EXPECT_TRUE(outcomes_["y"].status.ok());
}

}  // namespace
}  // namespace drape
