#include "server/session/sliced_command.h"

#include <gtest/gtest.h>

#include "tests/scheduler/fake_backend.h"

namespace drape {
namespace {

class SlicedCommandTest : public testing::Test {
 protected:
  FakeClock clock_;
  std::unique_ptr<Scheduler> scheduler_ =
      Scheduler::Start(FakeBackendFactory(std::make_shared<FakeDevice>()), {}, clock_).value();
};

TEST(SlicedCommand, ALargeClothIsASliceOfItsOwn) {
  EXPECT_EQ(ClothsPerSlice(1), kSliceCloths);
  EXPECT_EQ(ClothsPerSlice(1024), kSliceParticles / 1024);
  EXPECT_EQ(ClothsPerSlice(1u << 20), 1u);
}

TEST_F(SlicedCommandTest, TheRangesCoverEverythingOnceAndOthersComeBetween) {
  std::vector<std::pair<size_t, size_t>> ranges;
  size_t commands_between = 0;
  Awaited<Status> end;
  scheduler_->HoldForTest();
  ASSERT_TRUE(RunInSlices(
                  *scheduler_, "a", 10, 4,
                  [&](Backend&, size_t first, size_t last) {
                    ranges.emplace_back(first, last);
                    return Status::Ok();
                  },
                  [&, end](Backend&, const Status& status) mutable { end.Set(status); })
                  .ok());
  ASSERT_TRUE(scheduler_->Post("b", [&](Backend&) { commands_between = ranges.size(); }).ok());
  scheduler_->ReleaseForTest();
  EXPECT_TRUE(end.Get().ok());
  EXPECT_EQ(ranges, (std::vector<std::pair<size_t, size_t>>{{0, 4}, {4, 8}, {8, 10}}));
  EXPECT_EQ(commands_between, 1u);
}

TEST_F(SlicedCommandTest, AnErrorIsTheEnd) {
  int slices = 0;
  Awaited<Status> end;
  ASSERT_TRUE(RunInSlices(
                  *scheduler_, "a", 10, 1,
                  [&](Backend&, size_t first, size_t) {
                    ++slices;
                    return first < 2 ? Status::Ok() : Status(StatusCode::kInternal, "STOP", "");
                  },
                  [&, end](Backend&, const Status& status) mutable { end.Set(status); })
                  .ok());
  EXPECT_EQ(end.Get().reason(), "STOP");
  EXPECT_EQ(slices, 3);
}

TEST_F(SlicedCommandTest, WhatWasBegunIsFinishedWhenTheServerDrains) {
  size_t covered = 0;
  Awaited<Status> end;
  scheduler_->HoldForTest();
  ASSERT_TRUE(RunInSlices(
                  *scheduler_, "a", 100, 1,
                  [&](Backend&, size_t first, size_t last) {
                    covered += last - first;
                    return Status::Ok();
                  },
                  [&, end](Backend&, const Status& status) mutable { end.Set(status); })
                  .ok());
  scheduler_->Drain(0);
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(covered, 100u);
}

TEST_F(SlicedCommandTest, NothingIsCalledWhenTheSchedulerRefuses) {
  scheduler_->Drain(0);
  const Status status = RunInSlices(
      *scheduler_, "a", 1, 1,
      [](Backend&, size_t, size_t) {
        ADD_FAILURE();
        return Status::Ok();
      },
      [](Backend&, const Status&) { ADD_FAILURE(); });
  EXPECT_EQ(status.reason(), "DRAINING");
}

}  // namespace
}  // namespace drape
