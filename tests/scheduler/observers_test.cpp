#include "server/scheduler/observers.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/scheduler/fake_backend.h"

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
    EXPECT_EQ(DecideFrame(situation).wake_at_us, 3600000005) << max_hz;
  }
}

TEST(Observer, CreditSaturates) {
  int wakes = 0;
  Observer observer([&] { ++wakes; });
  observer.AddCredit(std::numeric_limits<uint32_t>::max());
  observer.AddCredit(7);
  EXPECT_EQ(wakes, 2);
}

// A set that is served by hand; completions run at once.
class ObserverSetTest : public testing::Test {
 protected:
  ObserverSetTest() : set_([](const std::function<void()>& function) { function(); }) {
    for (int k = 0; k < 2; ++k) cloths_.push_back(BeginCloth(backend_, ChainModel(2)));
  }

  ObserverSpec Spec() {
    ObserverSpec spec;
    spec.cloths = cloths_;
    spec.fields = {true, false};
    spec.on_frame = [this](ObservedFrame frame) { frames_.push_back(std::move(frame)); };
    spec.on_end = [this](const Status& status) { ends_.push_back(status); };
    return spec;
  }

  std::shared_ptr<Observer> Add(ObserverSpec spec, uint32_t credit) {
    auto observer = std::make_shared<Observer>([] {});
    observer->AddCredit(credit);
    set_.Add(std::move(spec), observer);
    return observer;
  }

  void StepCloth(size_t index) {
    const StepItem item{cloths_[index]->handle(), {}, false};
    cloths_[index]->CompleteStep(backend_.Step(std::span(&item, 1)).reports[0]);
  }

  std::optional<int64_t> Serve(int64_t now_us = 0) { return set_.Serve(backend_, now_us); }

  std::shared_ptr<FakeDevice> device_ = std::make_shared<FakeDevice>();
  FakeBackend backend_{device_};
  std::vector<std::shared_ptr<ClothRuntime>> cloths_;
  std::vector<ObservedFrame> frames_;
  std::vector<Status> ends_;
  ObserverSet set_;
};

TEST_F(ObserverSetTest, TheFirstFrameHoldsEveryClothAsItIs) {
  Add(Spec(), 5);
  Serve();
  ASSERT_EQ(frames_.size(), 1u);
  EXPECT_EQ(frames_[0].frame, 1u);
  EXPECT_EQ(frames_[0].cloth_indices, (std::vector<uint32_t>{0, 1}));
  EXPECT_EQ(frames_[0].states.cloths[1].completed_steps, 0u);
  Serve();
  EXPECT_EQ(frames_.size(), 1u);
}

TEST_F(ObserverSetTest, OnlyWhatChangedIsSentAgain) {
  Add(Spec(), 5);
  Serve();
  frames_.clear();
  StepCloth(1);
  Serve();
  ASSERT_EQ(frames_.size(), 1u);
  EXPECT_EQ(frames_[0].cloth_indices, std::vector<uint32_t>{1});
  EXPECT_EQ(frames_[0].states.cloths[0].completed_steps, 1u);
  EXPECT_EQ(std::get<std::vector<double>>(frames_[0].states.columns.positions_m),
            (std::vector<double>{0, -1, 0, 1, -1, 0}));
}

TEST_F(ObserverSetTest, FramesHoldTheParticlesThatAreWanted) {
  ObserverSpec spec = Spec();
  spec.fields.particles = {1};
  Add(std::move(spec), 5);
  Serve();
  StepCloth(1);
  Serve();
  ASSERT_EQ(frames_.size(), 2u);
  EXPECT_EQ(std::get<std::vector<double>>(frames_[0].states.columns.positions_m),
            (std::vector<double>{1, 0, 0, 1, 0, 0}));
  EXPECT_EQ(std::get<std::vector<double>>(frames_[1].states.columns.positions_m),
            (std::vector<double>{1, -1, 0}));
}

TEST_F(ObserverSetTest, EveryNStepsOnly) {
  ObserverSpec spec = Spec();
  spec.every_n_steps = 3;
  Add(std::move(spec), 100);
  Serve();
  frames_.clear();
  std::vector<uint64_t> steps;
  for (int step = 1; step <= 9; ++step) {
    StepCloth(0);
    Serve();
    for (const ObservedFrame& frame : frames_) {
      steps.push_back(frame.states.cloths[0].completed_steps);
    }
    frames_.clear();
  }
  EXPECT_EQ(steps, (std::vector<uint64_t>{3, 6, 9}));
}

TEST_F(ObserverSetTest, LatestFrameWinsAndDropsAreCounted) {
  const auto observer = Add(Spec(), 1);
  Serve();  // takes the credit
  frames_.clear();
  for (int step = 0; step < 5; ++step) {
    StepCloth(0);
    Serve();
  }
  EXPECT_TRUE(frames_.empty());
  EXPECT_EQ(device_->reads().size(), 1u);  // without credit nothing is read
  observer->AddCredit(1);
  Serve();
  ASSERT_EQ(frames_.size(), 1u);
  EXPECT_EQ(frames_[0].states.cloths[0].completed_steps, 5u);
  EXPECT_EQ(frames_[0].frames_dropped, 4u);
  observer->AddCredit(1);
  StepCloth(0);
  Serve();
  EXPECT_EQ(frames_.back().frames_dropped, 0u);  // since the previous frame
}

TEST_F(ObserverSetTest, AReceiverThatKeepsItsFramesGetsNoMore) {
  Add(Spec(), 100);
  for (int step = 0; step < 5; ++step) {
    Serve();
    StepCloth(0);
  }
  EXPECT_EQ(frames_.size(), kMaxFramesInFlight);
  frames_.clear();
  Serve();
  ASSERT_EQ(frames_.size(), 1u);
  EXPECT_EQ(frames_[0].states.cloths[0].completed_steps, 5u);
}

TEST_F(ObserverSetTest, AfterAPauseTheLatestStateIsSent) {
  const auto observer = Add(Spec(), 10);
  Serve();
  frames_.clear();
  observer->SetPaused(true);
  for (int step = 0; step < 3; ++step) {
    StepCloth(0);
    Serve();
  }
  EXPECT_TRUE(frames_.empty());
  observer->SetPaused(false);
  Serve();
  ASSERT_EQ(frames_.size(), 1u);
  EXPECT_EQ(frames_[0].states.cloths[0].completed_steps, 3u);
  EXPECT_EQ(frames_[0].frames_dropped, 0u);
}

TEST_F(ObserverSetTest, TheRateIsLimitedAndTheLastStateStillComes) {
  ObserverSpec spec = Spec();
  spec.max_hz = 100;
  Add(std::move(spec), 10);
  EXPECT_EQ(Serve(0), std::nullopt);
  frames_.clear();
  StepCloth(0);
  EXPECT_EQ(Serve(9999), 10000);
  EXPECT_TRUE(frames_.empty());
  EXPECT_EQ(Serve(10000), std::nullopt);
  EXPECT_EQ(frames_.size(), 1u);
}

TEST_F(ObserverSetTest, AResetIsSeen) {
  ObserverSpec spec = Spec();
  spec.every_n_steps = 100;
  Add(std::move(spec), 10);
  Serve();
  frames_.clear();
  cloths_[0]->Reset({}, {});
  Serve();
  ASSERT_EQ(frames_.size(), 1u);
  EXPECT_EQ(frames_[0].cloth_indices, std::vector<uint32_t>{0});
}

TEST_F(ObserverSetTest, ItGoesOnWithTheClothsThatAreLeftAndEndsWithTheLast) {
  Add(Spec(), 10);
  Serve();
  frames_.clear();
  cloths_[0]->End({StatusCode::kNotFound, "CLOTH_NOT_FOUND", ""});
  backend_.Destroy(cloths_[0]->handle());
  StepCloth(1);
  Serve();
  ASSERT_EQ(frames_.size(), 1u);
  EXPECT_TRUE(ends_.empty());
  cloths_[1]->End({StatusCode::kNotFound, "CLOTH_NOT_FOUND", ""});
  Serve();
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].reason(), "CLOTH_NOT_FOUND");
  EXPECT_EQ(set_.size(), 0u);
}

TEST_F(ObserverSetTest, CancelEndsIt) {
  const auto observer = Add(Spec(), 10);
  observer->Cancel();
  Serve();
  EXPECT_TRUE(frames_.empty());
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].code(), StatusCode::kCancelled);
}

// --- Every frame.

ObserverSpec Queued(ObserverSpec spec, uint32_t max_frames, uint64_t max_bytes) {
  spec.queue = FrameQueue{max_frames, max_bytes, /*bytes_per_row=*/24, /*bytes_per_cloth=*/100};
  return spec;
}

TEST_F(ObserverSetTest, EveryFrameIsSentWithoutCredit) {
  ObserverSpec spec = Queued(Spec(), 100, 1 << 20);
  spec.every_n_steps = 3;
  Add(std::move(spec), 0);
  std::vector<uint64_t> steps;
  for (int step = 1; step <= 10; ++step) {
    StepCloth(0);
    Serve();
    Serve();  // nothing new: nothing is sent
    for (const ObservedFrame& frame : frames_) {
      EXPECT_EQ(frame.cloth_indices.size(), steps.empty() ? 2u : 1u) << "only what is due";
      steps.push_back(frame.states.cloths[0].completed_steps);
    }
    frames_.clear();
  }
  EXPECT_EQ(steps, (std::vector<uint64_t>{1, 3, 6, 9}));
  EXPECT_EQ(set_.counters().frames_sent, 4u);
  EXPECT_EQ(set_.counters().frames_dropped, 0u);
}

TEST_F(ObserverSetTest, EveryFrameHoldsClothsThatAreDueAndNoOthers) {
  ObserverSpec spec = Queued(Spec(), 100, 1 << 20);
  spec.every_n_steps = 2;
  Add(std::move(spec), 0);
  Serve();
  StepCloth(0);
  StepCloth(1);
  Serve();
  StepCloth(1);
  Serve();
  ASSERT_EQ(frames_.size(), 2u);
  EXPECT_EQ(frames_[1].cloth_indices, std::vector<uint32_t>{1});
  cloths_[0]->Reset({}, {});
  Serve();
  ASSERT_EQ(frames_.size(), 3u);
  EXPECT_EQ(frames_[2].cloth_indices, std::vector<uint32_t>{0});
  EXPECT_EQ(frames_[2].states.cloths[0].completed_steps, 0u);
}

TEST_F(ObserverSetTest, AStepAsleepIsAFrameToo) {
  Add(Queued(Spec(), 100, 1 << 20), 0);
  Serve();
  cloths_[0]->CompleteStepAsleep();
  Serve();
  ASSERT_EQ(frames_.size(), 2u);
  EXPECT_EQ(frames_[1].states.cloths[0].completed_steps, 1u);
}

TEST_F(ObserverSetTest, AFullQueueOfFramesEndsTheSubscriptionAndReadsNoMore) {
  Add(Queued(Spec(), 3, 1 << 20), 0);
  for (int step = 0; step < 3; ++step) {
    Serve();
    StepCloth(0);
  }
  EXPECT_TRUE(ends_.empty());
  Serve();
  EXPECT_EQ(frames_.size(), 3u) << "they belong to the receiver";
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(ends_[0].reason(), "SLOW_CONSUMER");
  EXPECT_EQ(set_.counters().slow_consumers, 1u);
  StepCloth(0);
  Serve();
  EXPECT_EQ(device_->reads().size(), 3u);
  EXPECT_EQ(set_.size(), 0u);
}

TEST_F(ObserverSetTest, AReceiverThatKeepsUpIsNeverSlow) {
  Add(Queued(Spec(), 2, 1 << 20), 0);
  for (uint64_t step = 0; step < 100; ++step) {
    Serve();
    ASSERT_EQ(frames_.size(), 1u);
    EXPECT_EQ(frames_[0].frame, step + 1);
    frames_.clear();
    StepCloth(0);
  }
  EXPECT_TRUE(ends_.empty());
}

TEST_F(ObserverSetTest, TheQueueIsBoundedInBytes) {
  // The first frame: 2 cloths of 2 rows. Each other one: one of them.
  constexpr uint64_t kCloth = 100 + 2 * 24;
  Add(Queued(Spec(), 100, 2 * kCloth + 3 * kCloth), 0);
  Serve();
  for (int step = 0; step < 3; ++step) {
    StepCloth(0);
    Serve();
  }
  EXPECT_EQ(frames_.size(), 4u);
  EXPECT_TRUE(ends_.empty());
  frames_.erase(frames_.begin() + 1);  // makes room for one more
  for (int step = 0; step < 2; ++step) {
    StepCloth(0);
    Serve();
  }
  EXPECT_EQ(frames_.size(), 4u);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].reason(), "SLOW_CONSUMER");
}

TEST_F(ObserverSetTest, WhatWasSteppedBeforeTheCancelStillComes) {
  const auto observer = Add(Queued(Spec(), 100, 1 << 20), 0);
  Serve();
  StepCloth(0);
  observer->Cancel();
  Serve();
  EXPECT_EQ(frames_.size(), 2u);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].code(), StatusCode::kCancelled);
}

}  // namespace
}  // namespace drape
