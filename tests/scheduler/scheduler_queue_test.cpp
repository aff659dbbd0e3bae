// How many requests may wait.
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "tests/scheduler/scheduler_fixture.h"

namespace drape {
namespace {

using SchedulerQueueTest = SchedulerTest;

TEST_F(SchedulerQueueTest, IsBoundedPerSessionAndInAll) {
  SchedulerLimits limits;
  limits.max_queued_requests_per_session = 2;
  limits.max_queued_requests = 3;
  limits.max_queued_commands = 1;
  Start(limits);
  const auto cloth = Cloth();
  scheduler_->HoldForTest();
  EXPECT_TRUE(TrySubmit("a", cloth).ok());
  EXPECT_TRUE(TrySubmit("a", cloth).ok());
  const Status full = TrySubmit("a", cloth);
  EXPECT_EQ(full.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(full.reason(), "QUEUE_FULL");
  EXPECT_EQ(full.retry_after_ms(), limits.retry_after_ms);
  EXPECT_TRUE(TrySubmit("b", cloth).ok());
  EXPECT_EQ(TrySubmit("c", cloth).reason(), "QUEUE_FULL");
  EXPECT_TRUE(scheduler_->Post("a", [](Backend&) {}).ok());
  EXPECT_EQ(scheduler_->Post("a", [](Backend&) {}).reason(), "QUEUE_FULL");
  EXPECT_TRUE(scheduler_->PostCleanup("a", [](Backend&) {}));
  scheduler_->ReleaseForTest();
  // Places are free again once the answers are given.
  while (scheduler_->counters().queued_requests > 0) std::this_thread::yield();
  EXPECT_TRUE(TrySubmit("a", cloth).ok());
}

TEST_F(SchedulerQueueTest, OwnersWhoseCommandsWaitLeaveRoomForOthers) {
  SchedulerLimits limits;
  limits.max_queued_commands = 8;
  Start(limits);
  scheduler_->HoldForTest();
  int greedy = 0;
  while (scheduler_->Post("greedy", [](Backend&) {}).ok()) ++greedy;
  EXPECT_EQ(greedy, 4);
  EXPECT_TRUE(scheduler_->Post("modest", [](Backend&) {}).ok());
  scheduler_->ReleaseForTest();
}

// Each command takes the device for longer than a batch may; a step of somebody else comes between.
TEST_F(SchedulerQueueTest, LongCommandsLeaveTheDeviceToOthers) {
  SchedulerLimits limits;
  limits.batch_budget_us = 20'000;
  Start(limits);
  const auto cloth = Cloth();
  std::vector<std::string> order;
  scheduler_->HoldForTest();
  const auto lasts_long = [&](Backend&) {
    order.emplace_back("long");
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
  };
  for (int k = 0; k < 3; ++k) ASSERT_TRUE(scheduler_->Post("greedy", lasts_long).ok());
  ASSERT_TRUE(scheduler_->Post("modest", [&](Backend&) { order.emplace_back("short"); }).ok());
  scheduler_->ReleaseForTest();
  while (scheduler_->counters().queued_commands > 0) std::this_thread::yield();
  ASSERT_TRUE(scheduler_->RunBlocking([](Backend&) { return Status::Ok(); }).ok());
  EXPECT_EQ(order, (std::vector<std::string>{"long", "short", "long", "long"}));
}

TEST_F(SchedulerQueueTest, TenantsWhoseRequestsWaitLeaveRoomForOthers) {
  SchedulerLimits limits;
  limits.max_queued_requests = 60;
  Start(limits);
  const auto cloth = Cloth();
  scheduler_->HoldForTest();
  const auto fill = [&](const std::string& tenant) {
    int count = 0;
    while (TrySubmit(tenant + std::to_string(count), cloth, tenant).ok()) ++count;
    return count;
  };
  EXPECT_EQ(fill("a"), 30);
  EXPECT_EQ(fill("b"), 15);
  EXPECT_EQ(fill("c"), 8) << "15 were free: each of two may be as large as what is left";
  EXPECT_EQ(fill("a"), 0);
  EXPECT_TRUE(TrySubmit("d0", cloth, "d").ok());
  scheduler_->ReleaseForTest();
  while (scheduler_->counters().queued_requests > 0) std::this_thread::yield();
  scheduler_->HoldForTest();
  EXPECT_EQ(fill("b"), 30);
  scheduler_->ReleaseForTest();
}

}  // namespace
}  // namespace drape
