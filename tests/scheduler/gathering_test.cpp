#include "server/scheduler/gathering.h"

#include <gtest/gtest.h>

namespace drape {
namespace {

constexpr int64_t kMaxDelay_us = 1000;
constexpr int64_t kBatch_us = 200;
constexpr int64_t kDelay_us = 2 * kBatch_us;

// The session asks, is answered at `now_us`, and was back once before within `gap_us`.
void ShowTo(Gathering& gathering, const std::string& session, int64_t gap_us, int64_t now_us) {
  gathering.Arrive(session, now_us - gap_us);
  gathering.Answer(session, 0, now_us - gap_us);
  gathering.Arrive(session, now_us);
  gathering.Answer(session, 0, now_us);
}

class GatheringTest : public testing::Test {
 protected:
  GatheringTest() { gathering_.EndBatch(kBatch_us); }

  void Show(const std::string& session, int64_t gap_us, int64_t now_us) {
    ShowTo(gathering_, session, gap_us, now_us);
  }

  Gathering gathering_{kMaxDelay_us};
};

TEST_F(GatheringTest, NobodyIsAwaitedBeforeItHasComeBack) {
  EXPECT_EQ(gathering_.WaitUntil(0), std::nullopt);
  gathering_.Arrive("a", 0);
  EXPECT_EQ(gathering_.WaitUntil(0), std::nullopt);
  gathering_.Answer("a", 0, 100);
  EXPECT_EQ(gathering_.awaited_count(), 0u);
  EXPECT_EQ(gathering_.WaitUntil(100), std::nullopt);
}

TEST_F(GatheringTest, WhoCameBackInTimeIsAwaitedUntilItIsThereAgain) {
  Show("a", 100, 5000);
  Show("b", kDelay_us - 1, 5000);
  EXPECT_EQ(gathering_.awaited_count(), 2u);
  EXPECT_EQ(gathering_.WaitUntil(5000), 5000 + kDelay_us);
  gathering_.Arrive("b", 5010);
  EXPECT_EQ(gathering_.awaited_count(), 1u);
  EXPECT_EQ(gathering_.WaitUntil(5010), 5000 + kDelay_us);
  gathering_.Arrive("a", 5020);
  EXPECT_EQ(gathering_.awaited_count(), 0u);
  EXPECT_EQ(gathering_.WaitUntil(5020), std::nullopt);
}

TEST_F(GatheringTest, WhoCameBackLateIsNotAwaited) {
  Show("a", kDelay_us, 5000);
  EXPECT_EQ(gathering_.awaited_count(), 0u);
}

TEST_F(GatheringTest, WhoStaysAwayIsForgottenAndHasToShowAnew) {
  Show("a", 100, 5000);
  EXPECT_TRUE(gathering_.WaitUntil(5000 + kDelay_us - 1).has_value());
  EXPECT_EQ(gathering_.WaitUntil(5000 + kDelay_us), std::nullopt);
  EXPECT_EQ(gathering_.awaited_count(), 0u);
  gathering_.Arrive("a", 6000);
  gathering_.Answer("a", 0, 6100);
  EXPECT_EQ(gathering_.awaited_count(), 0u);
  gathering_.Arrive("a", 6200);
  gathering_.Answer("a", 0, 6300);
  EXPECT_EQ(gathering_.awaited_count(), 1u);
}

TEST_F(GatheringTest, NobodyIsAwaitedForLongerThanTheLimit) {
  gathering_.EndBatch(1'000'000);
  Show("a", kMaxDelay_us - 1, 5000);
  EXPECT_EQ(gathering_.WaitUntil(5000), 5000 + kMaxDelay_us);
  Gathering none(0);
  none.EndBatch(1'000'000);
  for (const int64_t now_us : {0, 1, 2}) {
    none.Arrive("a", now_us);
    none.Answer("a", 0, now_us);
    EXPECT_EQ(none.awaited_count(), 0u);
    EXPECT_EQ(none.WaitUntil(now_us), std::nullopt);
  }
}

TEST_F(GatheringTest, OneThatCameBackQuicklyIsLookedFor) {
  constexpr int64_t kLong_us = 10 * Gathering::kSpin_us;
  Gathering gathering(kLong_us);
  gathering.EndBatch(kLong_us);
  EXPECT_EQ(gathering.SpinUntil(), 0);
  ShowTo(gathering, "slow", Gathering::kSpin_us, 50'000);
  EXPECT_EQ(gathering.awaited_count(), 1u);
  EXPECT_EQ(gathering.SpinUntil(), 0) << "it is slept for";
  ShowTo(gathering, "quick", Gathering::kSpin_us - 1, 55'000);
  gathering.Arrive("quick", 55'001);
  EXPECT_EQ(gathering.SpinUntil(), 0) << "the slow one is awaited still";
  gathering.Arrive("slow", 55'002);
  ShowTo(gathering, "quick", Gathering::kSpin_us - 1, 60'000);
  EXPECT_EQ(gathering.SpinUntil(), 60'000 + Gathering::kSpin_us);
  ShowTo(gathering, "other", 10, 60'100);
  EXPECT_EQ(gathering.SpinUntil(), 0) << "two are awaited";
  gathering.Arrive("other", 60'110);
  gathering.Arrive("quick", 60'120);
  EXPECT_EQ(gathering.SpinUntil(), 0) << "nobody is";
}

// Steps of some microseconds: the way of a request takes longer than a batch waits for it.
TEST_F(GatheringTest, OneThatIsQuickIsLookedForThoughNoBatchWaitsForIt) {
  constexpr int64_t kAway_us = Gathering::kSpin_us - 1;
  ASSERT_LT(kDelay_us, kAway_us);
  Show("a", kAway_us, 5000);
  EXPECT_EQ(gathering_.awaited_count(), 0u);
  EXPECT_EQ(gathering_.WaitUntil(5000), std::nullopt);
  EXPECT_EQ(gathering_.SpinUntil(), 5000 + Gathering::kSpin_us);
  EXPECT_EQ(gathering_.WaitUntil(5000 + kDelay_us), std::nullopt);
  gathering_.Arrive("a", 5000 + kAway_us);
  EXPECT_EQ(gathering_.SpinUntil(), 0) << "it is there";
  gathering_.Answer("a", 0, 6000);
  EXPECT_EQ(gathering_.SpinUntil(), 6000 + Gathering::kSpin_us);
}

TEST_F(GatheringTest, WhoStaysAwayIsNotLookedFor) {
  Show("a", 10, 5000);
  EXPECT_EQ(gathering_.WaitUntil(5000 + Gathering::kSpin_us), std::nullopt);
  EXPECT_EQ(gathering_.SpinUntil(), 0);
  Show("b", Gathering::kSpin_us - 1, 9000);
  EXPECT_EQ(gathering_.SpinUntil(), 9000 + Gathering::kSpin_us) << "the other is forgotten";
}

TEST_F(GatheringTest, NobodyIsLookedForIfBatchesDoNotWait) {
  Gathering none(0);
  none.EndBatch(kBatch_us);
  ShowTo(none, "a", 0, 5000);
  EXPECT_EQ(none.SpinUntil(), 0);
}

// Else a small batch, which leaves no time for the others, would be followed by a small batch.
TEST_F(GatheringTest, OneSmallBatchDoesNotEndTheWaiting) {
  gathering_.EndBatch(10);
  Show("a", 300, 5000);
  EXPECT_EQ(gathering_.WaitUntil(5000), 5360) << "twice nine tenths";
  for (int batch = 0; batch < 50; ++batch) gathering_.EndBatch(10);
  EXPECT_EQ(gathering_.WaitUntil(5000), 5020);
}

TEST_F(GatheringTest, WhoHasOtherRequestsUnderWayIsThere) {
  Show("a", 100, 5000);
  gathering_.Arrive("a", 5100);
  gathering_.Arrive("a", 5110);
  gathering_.Answer("a", 1, 5200);
  EXPECT_EQ(gathering_.awaited_count(), 0u);
  gathering_.Answer("a", 0, 5300);
  EXPECT_EQ(gathering_.WaitUntil(5300), 5300 + kDelay_us);
}

}  // namespace
}  // namespace drape
