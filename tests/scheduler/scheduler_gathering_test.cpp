#include "tests/scheduler/scheduler_fixture.h"

namespace drape {
namespace {

// With steps of 1 ms: "a" and "b" ask for a step and, when they have the answer, at once for
// another.
class SchedulerGatheringTest : public SchedulerTest {
 protected:
  SchedulerGatheringTest() {
    device_->OnStep([this] { clock_.AdvanceUs(1000); });
    Start();
    a_ = Cloth();
    b_ = Cloth();
    for (int request = 0; request < 2; ++request) {
      scheduler_->HoldForTest();
      const auto first = Submit("a", {a_}), second = Submit("b", {b_});
      scheduler_->ReleaseForTest();
      EXPECT_EQ(first.Get().timing.batch_requests, 2u);
      EXPECT_EQ(second.Get().timing.batch_requests, 2u);
    }
  }

  // The device thread has looked at what was submitted before.
  void LetTheDeviceThreadLook() {
    for (int look = 0; look < 2; ++look) {
      EXPECT_TRUE(scheduler_->RunBlocking([](Backend&) { return Status::Ok(); }).ok());
    }
  }

  std::shared_ptr<ClothRuntime> a_, b_;
};

TEST_F(SchedulerGatheringTest, ABatchWaitsForWhoIsAboutToComeBack) {
  const auto first = Submit("a", {a_});
  LetTheDeviceThreadLook();  // commands do not wait
  EXPECT_FALSE(first.has_value());
  EXPECT_EQ(scheduler_->counters().rounds, 2u);
  clock_.AdvanceUs(100);
  const auto second = Submit("b", {b_});
  EXPECT_EQ(first.Get().timing.batch_requests, 2u);
  EXPECT_EQ(first.Get().timing.queue_us, 100);
  EXPECT_EQ(second.Get().timing.queue_us, 0);
}

TEST_F(SchedulerGatheringTest, ABatchWaitsNoLongerThanTwoBatchesTake) {
  const auto first = Submit("a", {a_});
  clock_.AdvanceUs(1999);
  LetTheDeviceThreadLook();
  EXPECT_FALSE(first.has_value());
  clock_.AdvanceUs(1);
  EXPECT_EQ(first.Get().timing.batch_requests, 1u);
  EXPECT_EQ(first.Get().timing.queue_us, 2000);
  EXPECT_EQ(Submit("a", {a_}).Get().timing.queue_us, 0) << "who stayed away is forgotten";
}

TEST_F(SchedulerGatheringTest, DrainDoesNotWaitForAnybody) {
  const auto first = Submit("a", {a_});
  scheduler_->Drain(1000000);
  EXPECT_TRUE(first.Get().status.ok());
  EXPECT_EQ(first.Get().timing.queue_us, 0);
}

}  // namespace
}  // namespace drape
