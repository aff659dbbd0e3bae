#include "server/api/run_pace.h"

#include <gtest/gtest.h>

#include <cmath>

namespace drape::api {
namespace {

constexpr int64_t kBegin_us = 5'000'000;

// Begins all steps that are due; how many.
uint64_t BeginAll(RunPace& pace, int64_t now_us) {
  uint64_t count = 0;
  for (; pace.IsDue(now_us); ++count) pace.Begin();
  return count;
}

TEST(RunPace, StepsAreDueAtTheirTimesAndNotBefore) {
  RunPace pace(10'000, 100'000, kBegin_us);
  EXPECT_EQ(BeginAll(pace, kBegin_us), 1u) << "the first one at once";
  EXPECT_EQ(pace.NextDue_us(), kBegin_us + 10'000);
  EXPECT_EQ(BeginAll(pace, kBegin_us + 9'999), 0u);
  EXPECT_EQ(BeginAll(pace, kBegin_us + 10'000), 1u);
  EXPECT_EQ(BeginAll(pace, kBegin_us + 35'000), 2u) << "what is late is caught up";
  EXPECT_EQ(pace.dropped(), 0u);
}

TEST(RunPace, StepsThatAreTooLateAreDroppedAndCounted) {
  RunPace pace(10'000, 100'000, kBegin_us);
  // Due: at 0, 10, ..., 150 ms. Those before 50 ms are more than 100 ms late.
  EXPECT_EQ(BeginAll(pace, kBegin_us + 150'000), 11u);
  EXPECT_EQ(pace.dropped(), 5u);
  EXPECT_EQ(pace.NextDue_us(), kBegin_us + 160'000) << "the others stay where they were";
}

// Whatever the moments at which it is asked, every step is either begun or dropped, none twice.
TEST(RunPace, EveryStepIsBegunOrDropped) {
  for (const double interval_us : {1.0, 333.3, 16'666.666, 2'000'000.0}) {
    RunPace pace(interval_us, 40'000, kBegin_us);
    uint64_t begun = 0;
    int64_t now_us = kBegin_us;
    for (int k = 0; k < 2000; ++k) {
      now_us += k % 7 == 0 ? 90'000 : k % 5 * 1000;
      // Not all of them at once.
      for (int free = 0; free < 3 && pace.IsDue(now_us); ++free, ++begun) pace.Begin();
      const auto due = static_cast<uint64_t>(
          std::floor(static_cast<double>(now_us - kBegin_us) / interval_us) + 1);
      ASSERT_EQ(begun + pace.dropped() + pace.Waiting(now_us), due) << interval_us << " " << k;
    }
  }
}

TEST(RunPace, NothingIsDueOrLateInAPause) {
  RunPace pace(10'000, 100'000, kBegin_us);
  EXPECT_EQ(BeginAll(pace, kBegin_us), 1u);
  pace.SetPaused(true, kBegin_us + 4'000);
  EXPECT_EQ(pace.NextDue_us(), std::nullopt);
  EXPECT_FALSE(pace.IsDue(kBegin_us + 60'000'000));
  EXPECT_EQ(pace.Waiting(kBegin_us + 60'000'000), 0u);
  EXPECT_EQ(pace.Elapsed_us(kBegin_us + 60'000'000), 4'000);
  pace.SetPaused(false, kBegin_us + 60'000'000);
  pace.SetPaused(false, kBegin_us + 61'000'000);  // it is not paused: no effect
  EXPECT_EQ(pace.NextDue_us(), kBegin_us + 60'006'000) << "6 ms were left";
  EXPECT_EQ(BeginAll(pace, kBegin_us + 60'006'000), 1u);
  EXPECT_EQ(pace.dropped(), 0u);
}

TEST(RunPace, WithoutAPaceAStepIsAlwaysDue) {
  RunPace pace(0, 100'000, kBegin_us);
  for (int k = 0; k < 100; ++k) {
    EXPECT_TRUE(pace.IsDue(kBegin_us));
    pace.Begin();
  }
  EXPECT_EQ(pace.Waiting(kBegin_us + 1'000'000), 0u);
  EXPECT_EQ(pace.NextDue_us(), kBegin_us);
  pace.SetPaused(true, kBegin_us);
  EXPECT_FALSE(pace.IsDue(kBegin_us));
}

// Two days at a million steps per second: no step is lost to rounding.
TEST(RunPace, LongRunsStayExact) {
  RunPace pace(1, 20'000, 0);
  constexpr int64_t kDays_us = int64_t{2} * 86'400 * 1'000'000;
  EXPECT_TRUE(pace.IsDue(kDays_us));
  EXPECT_EQ(pace.dropped(), static_cast<uint64_t>(kDays_us) - 20'000);
  EXPECT_EQ(pace.Waiting(kDays_us), 20'001u);
}

}  // namespace
}  // namespace drape::api
