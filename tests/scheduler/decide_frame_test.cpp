// When a subscription gets its latest state.
#include <gtest/gtest.h>

#include <limits>

#include "server/scheduler/observers.h"

namespace drape {
namespace {

FrameSituation Due() {
  FrameSituation situation;
  situation.is_newly_due = true;
  situation.credit = 1;
  return situation;
}

TEST(DecideFrame, NothingDueNothingSent) {
  FrameSituation situation = Due();
  situation.is_newly_due = false;
  const FrameDecision decision = DecideFrame(situation);
  EXPECT_FALSE(decision.send);
  EXPECT_FALSE(decision.is_owed);
}

TEST(DecideFrame, ADueFrameWithCreditIsSent) {
  const FrameDecision decision = DecideFrame(Due());
  EXPECT_TRUE(decision.send);
  EXPECT_FALSE(decision.is_owed);
  EXPECT_FALSE(decision.is_dropped);
}

TEST(DecideFrame, WithoutCreditTheFrameIsOwedAndTheOneBeforeItDropped) {
  FrameSituation situation = Due();
  situation.credit = 0;
  FrameDecision decision = DecideFrame(situation);
  EXPECT_FALSE(decision.send);
  EXPECT_TRUE(decision.is_owed);
  EXPECT_FALSE(decision.is_dropped);
  situation.is_owed = decision.is_owed;
  situation.lacked_credit = decision.lacked_credit;
  decision = DecideFrame(situation);
  EXPECT_TRUE(decision.is_owed);
  EXPECT_TRUE(decision.is_dropped);
}

TEST(DecideFrame, WhatLackedCreditCountsAlsoWhereTheNextOneIsSent) {
  FrameSituation situation = Due();
  situation.is_owed = true;
  situation.lacked_credit = true;
  FrameDecision decision = DecideFrame(situation);
  EXPECT_TRUE(decision.send);
  EXPECT_TRUE(decision.is_dropped);
  EXPECT_FALSE(decision.lacked_credit);
  situation.is_newly_due = false;
  EXPECT_FALSE(DecideFrame(situation).is_dropped) << "it is the one that is sent";
  situation.is_newly_due = true;
  situation.lacked_credit = false;
  EXPECT_FALSE(DecideFrame(situation).is_dropped) << "a pause or the rate limit held it back";
}

TEST(DecideFrame, AnOwedFrameGoesAsSoonAsThereIsCredit) {
  FrameSituation situation = Due();
  situation.is_newly_due = false;
  situation.is_owed = true;
  EXPECT_TRUE(DecideFrame(situation).send);
}

TEST(DecideFrame, FramesInFlightAreLimitedWhateverTheCredit) {
  FrameSituation situation = Due();
  situation.credit = 100;
  situation.frames_in_flight = kMaxFramesInFlight;
  EXPECT_FALSE(DecideFrame(situation).send);
  EXPECT_TRUE(DecideFrame(situation).is_owed);
}

TEST(DecideFrame, APauseHoldsBackWithoutCounting) {
  FrameSituation situation = Due();
  situation.is_paused = true;
  situation.is_owed = true;
  const FrameDecision decision = DecideFrame(situation);
  EXPECT_FALSE(decision.send);
  EXPECT_TRUE(decision.is_owed);
  EXPECT_FALSE(decision.is_dropped);
}

TEST(DecideFrame, TheRateLimitNamesWhenToLookAgain) {
  FrameSituation situation = Due();
  situation.max_hz = 10;
  EXPECT_TRUE(DecideFrame(situation).send);  // the first frame waits for nothing
  situation.last_frame_us = 1000000;
  situation.now_us = 1099999;
  const FrameDecision decision = DecideFrame(situation);
  EXPECT_FALSE(decision.send);
  EXPECT_TRUE(decision.is_owed);
  EXPECT_FALSE(decision.is_dropped);
  EXPECT_EQ(decision.wake_at_us, 1100000);
  situation.now_us = 1100000;
  EXPECT_TRUE(DecideFrame(situation).send);
}

TEST(DecideFrame, ATinyRateIsOneFramePerHour) {
  FrameSituation situation = Due();
  situation.last_frame_us = 5;
  situation.now_us = 6;
  for (const double max_hz : {1e-4, 1e-300, std::numeric_limits<double>::denorm_min()}) {
    situation.max_hz = max_hz;
    EXPECT_FALSE(DecideFrame(situation).send);
    EXPECT_EQ(DecideFrame(situation).wake_at_us, 3600000000) << max_hz;
  }
}

}  // namespace
}  // namespace drape
