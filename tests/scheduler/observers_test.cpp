#include "server/scheduler/observers.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/scheduler/fake_backend.h"

namespace drape {
namespace {

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
  EXPECT_EQ(frames_[0].content->cloth_indices, (std::vector<uint32_t>{0, 1}));
  EXPECT_EQ(frames_[0].content->states.cloths[1].completed_steps, 0u);
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
  EXPECT_EQ(frames_[0].content->cloth_indices, std::vector<uint32_t>{1});
  EXPECT_EQ(frames_[0].content->states.cloths[0].completed_steps, 1u);
  EXPECT_EQ(std::get<std::vector<double>>(frames_[0].content->states.columns.positions_m),
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
  EXPECT_EQ(std::get<std::vector<double>>(frames_[0].content->states.columns.positions_m),
            (std::vector<double>{1, 0, 0, 1, 0, 0}));
  EXPECT_EQ(std::get<std::vector<double>>(frames_[1].content->states.columns.positions_m),
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
      steps.push_back(frame.content->states.cloths[0].completed_steps);
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
  EXPECT_EQ(frames_[0].content->states.cloths[0].completed_steps, 5u);
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
  EXPECT_EQ(frames_[0].content->states.cloths[0].completed_steps, 5u);
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
  EXPECT_EQ(frames_[0].content->states.cloths[0].completed_steps, 3u);
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
  EXPECT_EQ(frames_[0].content->cloth_indices, std::vector<uint32_t>{0});
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

// --- Audiences.

ObserverSpec Queued(ObserverSpec spec, uint32_t max_frames, uint64_t max_bytes) {
  spec.queue = FrameQueue{max_frames, max_bytes, /*bytes_per_row=*/24, /*bytes_per_cloth=*/100};
  return spec;
}

TEST_F(ObserverSetTest, ViewersOfTheSameShareAReadAndAFrame) {
  for (int k = 0; k < 3; ++k) Add(Spec(), 5);
  Serve();
  ASSERT_EQ(frames_.size(), 3u);
  EXPECT_EQ(device_->reads().size(), 1u);
  EXPECT_EQ(frames_[0].content, frames_[1].content);
  EXPECT_EQ(frames_[0].content, frames_[2].content);
  StepCloth(0);
  Serve();
  EXPECT_EQ(device_->reads().size(), 2u);
  EXPECT_NE(frames_[3].content, frames_[0].content);
  EXPECT_EQ(frames_[3].content, frames_[5].content);
  EXPECT_EQ(frames_[3].content->states.cloths[0].completed_steps, 1u);
  EXPECT_EQ(set_.counters().frames_sent, 6u);
}

TEST_F(ObserverSetTest, OtherClothsFieldsOrEncodingsAreOtherAudiences) {
  Add(Spec(), 5);
  ObserverSpec fewer = Spec(), faster = Spec(), packed = Spec();
  fewer.cloths.pop_back();
  faster.fields.velocities = true;
  packed.encoding = "16 bits";
  for (const ObserverSpec& spec : {fewer, faster, packed}) Add(spec, 5);
  Serve();
  ASSERT_EQ(frames_.size(), 4u);
  EXPECT_EQ(device_->reads().size(), 4u);
  for (size_t k = 1; k < frames_.size(); ++k) EXPECT_NE(frames_[k].content, frames_[0].content);
}

// One who joins gets every cloth, the others what has changed.
TEST_F(ObserverSetTest, AnAudienceSharesOnlyFramesOfTheSameCloths) {
  Add(Spec(), 5);
  Serve();
  StepCloth(1);
  Add(Spec(), 5);
  Serve();
  ASSERT_EQ(frames_.size(), 3u);
  EXPECT_EQ(frames_[1].content->cloth_indices, std::vector<uint32_t>{1});
  EXPECT_EQ(frames_[2].content->cloth_indices, (std::vector<uint32_t>{0, 1}));
  frames_.clear();
  StepCloth(1);
  Serve();
  ASSERT_EQ(frames_.size(), 2u);
  EXPECT_EQ(frames_[0].content, frames_[1].content);
}

// However they began, viewers of one rate get their frames together.
TEST_F(ObserverSetTest, ViewersOfARateMeet) {
  ObserverSpec spec = Spec();
  spec.max_hz = 50;
  Add(spec, 100);
  Serve(1'000);
  Add(spec, 100);
  StepCloth(0);
  Serve(12'000);  // the first frame of the second one
  ASSERT_EQ(frames_.size(), 2u);
  frames_.clear();
  for (int64_t now_us = 13'000; now_us < 113'000; now_us += 1'000) {
    StepCloth(0);
    Serve(now_us);
    for (ObservedFrame& frame : frames_) frame.in_flight.reset();
  }
  ASSERT_EQ(frames_.size(), 10u) << "50 Hz for 100 ms, twice";
  for (size_t k = 0; k < frames_.size(); k += 2) {
    EXPECT_EQ(frames_[k].content, frames_[k + 1].content);
  }
}

TEST_F(ObserverSetTest, QueuesOfOneAudienceFillBySeparateRules) {
  Add(Queued(Spec(), 2, 1 << 20), 0);
  Add(Queued(Spec(), 100, 1 << 20), 0);
  for (int step = 0; step < 4; ++step) {
    Serve();
    StepCloth(0);
  }
  EXPECT_EQ(ends_.size(), 1u);
  EXPECT_EQ(frames_.size(), 2u + 4u);
  EXPECT_EQ(device_->reads().size(), 4u);
}

// --- Every frame.

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
      EXPECT_EQ(frame.content->cloth_indices.size(), steps.empty() ? 2u : 1u) << "only what is due";
      steps.push_back(frame.content->states.cloths[0].completed_steps);
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
  EXPECT_EQ(frames_[1].content->cloth_indices, std::vector<uint32_t>{1});
  cloths_[0]->Reset({}, {});
  Serve();
  ASSERT_EQ(frames_.size(), 3u);
  EXPECT_EQ(frames_[2].content->cloth_indices, std::vector<uint32_t>{0});
  EXPECT_EQ(frames_[2].content->states.cloths[0].completed_steps, 0u);
}

TEST_F(ObserverSetTest, AStepAsleepIsAFrameToo) {
  Add(Queued(Spec(), 100, 1 << 20), 0);
  Serve();
  cloths_[0]->CompleteStepAsleep();
  Serve();
  ASSERT_EQ(frames_.size(), 2u);
  EXPECT_EQ(frames_[1].content->states.cloths[0].completed_steps, 1u);
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
