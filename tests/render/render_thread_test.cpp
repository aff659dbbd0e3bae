#include "server/render/render_thread.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <mutex>
#include <thread>

#include "tests/render/fake_renderer.h"
#include "tests/support/png/png_image.h"

namespace drape::render {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class RenderThreadTest : public testing::Test {
 protected:
  void Start(const RenderLimits& limits = {}) {
    thread_ = std::make_unique<RenderThread>(studio_.Factory(), limits);
  }
  ~RenderThreadTest() override {
    studio_.Release();
    thread_.reset();
    EXPECT_EQ(studio_.alive(), 0);
    EXPECT_EQ(studio_.calls_on_wrong_thread(), 0);
  }

  Outcome Submit(PictureJob job, const Outcome& outcome) {
    const Status status = thread_->Submit(std::move(job));
    EXPECT_TRUE(status.ok()) << status.ToString();
    return outcome;
  }
  Outcome Submit(const std::string& session, uint32_t width_px) {
    const Outcome outcome;
    return Submit(Job(session, width_px, outcome), outcome);
  }
  // Whether one more would be taken: one that is.
  Status Try(const std::string& session) { return thread_->Submit(Job(session, 99, Outcome())); }

  FakeStudio studio_;
  std::unique_ptr<RenderThread> thread_;
};

// Content that records its destruction: it must be dropped on the right thread.
struct Tracked {
  std::atomic<int> dropped{0};
  std::atomic<std::thread::id> dropped_on{};

  std::shared_ptr<DeviceCopy> NewCopy() {
    const auto holder = std::shared_ptr<int>(new int(0), [this](const int* number) {
      delete number;
      dropped_on = std::this_thread::get_id();
      ++dropped;
    });
    // Only its life counts here.
    return {holder, reinterpret_cast<DeviceCopy*>(holder.get())};
  }
  PictureContent NewContent() {
    PictureContent content;
    content.states.device = NewCopy();
    return content;
  }
};

TEST_F(RenderThreadTest, ARendererIsMadeForTheFirstPictureAndKept) {
  Start();
  EXPECT_EQ(studio_.makes(), 0);
  const Outcome first = Submit("a", 20);
  ASSERT_TRUE(first.Get().ok()) << first.Get().status().ToString();
  const test::PngImage image = test::DecodePng(first.Get()->png);
  EXPECT_EQ(image.width_px, 20u);
  EXPECT_EQ(image.height_px, 16u);
  EXPECT_EQ(first.Get()->device, "fake");
  EXPECT_TRUE(Submit("a", 21).Get().ok());
  EXPECT_EQ(studio_.makes(), 1);
  thread_->Stop();
  EXPECT_EQ(studio_.alive(), 0);
}

TEST_F(RenderThreadTest, WhatTheRendererTakesIsAskedFor) {
  Start();
  PictureContent content;
  content.steps = {7, 8};
  std::atomic<bool> was_on_device = false;
  const Outcome outcome;
  PictureJob job = Job("a", 20, outcome);
  job.fetch = [&](bool on_device, const ContentReady& ready) {
    was_on_device = on_device;
    ready(content);
  };
  Submit(std::move(job), outcome);
  EXPECT_THAT(outcome.Get()->steps, ElementsAre(7, 8));
  EXPECT_TRUE(was_on_device);
}

TEST_F(RenderThreadTest, SessionsTakeTurns) {
  Start({.max_pictures_in_flight_per_session = 10});
  studio_.Hold();
  std::vector<Outcome> outcomes;
  outcomes.push_back(Submit("first", 1));
  studio_.WaitForHeldDraw();
  for (const uint32_t width : {2, 3, 4}) outcomes.push_back(Submit("first", width));
  for (const uint32_t width : {11, 12, 13, 14, 15, 16}) outcomes.push_back(Submit("greedy", width));
  for (const uint32_t width : {21, 22}) outcomes.push_back(Submit("modest", width));
  studio_.Release();
  for (const Outcome& outcome : outcomes) EXPECT_TRUE(outcome.Get().ok());
  EXPECT_THAT(studio_.drawn(), ElementsAre(1, 2, 11, 21, 3, 12, 22, 4, 13, 14, 15, 16));
}

TEST_F(RenderThreadTest, PermitsOfASessionAreTakenUntilItsFilesHaveLeft) {
  Start({.max_pictures_in_flight_per_session = 2});
  const Outcome first = Submit("a", 20);
  const Outcome second = Submit("a", 21);
  EXPECT_TRUE(first.Get().ok() && second.Get().ok());
  const Status refusal = Try("a");
  EXPECT_EQ(refusal.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(refusal.reason(), "TOO_MANY_PICTURES");
  EXPECT_THAT(refusal.message(), HasSubstr("max_pictures_in_flight_per_session is 2"));
  EXPECT_TRUE(refusal.retry_after_ms().has_value());
  EXPECT_TRUE(Try("b").ok()) << "another session does not notice";
  first.Drop();
  EXPECT_TRUE(Try("a").ok());
}

TEST_F(RenderThreadTest, TheQueueOfAllIsBounded) {
  Start({.max_queued_pictures = 2});
  studio_.Hold();
  Submit("drawn", 1);
  studio_.WaitForHeldDraw();
  // While one is drawn nothing is taken from the queue.
  Submit("a", 2);
  Submit("b", 3);
  const Status refusal = Try("c");
  EXPECT_EQ(refusal.reason(), "TOO_MANY_PICTURES");
  EXPECT_THAT(refusal.message(), HasSubstr("max_queued_pictures is 2"));
  EXPECT_TRUE(refusal.retry_after_ms().has_value());
}

// Of 8 places half for one alone, and half of the rest for the next one.
TEST_F(RenderThreadTest, TenantsLeaveRoomForOthers) {
  Start({.max_pictures_in_flight_per_session = 1, .max_queued_pictures = 8});
  studio_.Hold();
  Submit("drawn", 1);
  studio_.WaitForHeldDraw();
  const auto take_all = [&](const std::string& tenant) {
    for (size_t k = 0;; ++k) {
      PictureJob job = Job(tenant + std::to_string(k), 2, Outcome());  // in sessions of its own
      job.tenant = tenant;
      if (!thread_->Submit(std::move(job)).ok()) return k;
    }
  };
  EXPECT_EQ(take_all("greedy"), 4u);
  EXPECT_EQ(take_all("other"), 2u);
  EXPECT_TRUE(Try("modest").ok());
}

TEST_F(RenderThreadTest, APictureOfTooManyParticlesIsRefused) {
  Start({.max_particles_per_picture = 100});
  PictureJob job = Job("a", 20, Outcome());
  job.particle_count = 101;
  const Status refusal = thread_->Submit(std::move(job));
  EXPECT_EQ(refusal.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(refusal.reason(), "PICTURE_TOO_LARGE");
  EXPECT_THAT(refusal.message(), HasSubstr("max_particles_per_picture is 100: 101 wanted"));
  EXPECT_FALSE(refusal.retry_after_ms().has_value());
}

// Three contents of 40 particles would be more than 100 together: the third is fetched only when
// one of the first two has been drawn.
TEST_F(RenderThreadTest, ParticlesUnderWayAreBounded) {
  Start({.max_particles_per_picture = 100});
  std::atomic<int> fetched = 0;
  std::vector<ContentReady> waiting;
  std::mutex mutex;
  std::vector<Outcome> outcomes(3);
  for (uint32_t k = 0; k < 3; ++k) {
    PictureJob job = Job("a", 20 + k, outcomes[k]);
    job.particle_count = 40;
    job.fetch = [&](bool, const ContentReady& ready) {
      const std::lock_guard lock(mutex);
      waiting.push_back(ready);
      ++fetched;
    };
    Submit(std::move(job), outcomes[k]);
  }
  while (fetched < 2) std::this_thread::yield();
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(fetched, 2);
  {
    const std::lock_guard lock(mutex);
    waiting[0](PictureContent{});
  }
  EXPECT_TRUE(outcomes[0].Get().ok());
  while (fetched < 3) std::this_thread::yield();
  const std::lock_guard lock(mutex);
  waiting[1](PictureContent{});
  waiting[2](PictureContent{});
  EXPECT_TRUE(outcomes[1].Get().ok() && outcomes[2].Get().ok());
}

TEST_F(RenderThreadTest, WithoutARendererTheReasonIsToldAndItIsTriedAgain) {
  Start();
  studio_.FailNextMakes(1);
  const Outcome first = Submit("a", 20);
  EXPECT_EQ(first.Get().status().code(), StatusCode::kFailedPrecondition);
  EXPECT_EQ(first.Reason(), "NO_EGL_DEVICE");
  EXPECT_THAT(first.Get().status().message(), HasSubstr("install libegl1"));
  EXPECT_TRUE(Submit("a", 21).Get().ok());
  EXPECT_EQ(studio_.makes(), 2);
}

TEST_F(RenderThreadTest, ErrorsOfContentAndDrawingEndThatPictureAlone) {
  Start();
  const Outcome gone;
  PictureJob job = Job("a", 20, gone);
  job.fetch = [](bool, const ContentReady& ready) {
    ready(Status(StatusCode::kNotFound, "CLOTH_NOT_FOUND", "gone"));
  };
  Submit(std::move(job), gone);
  EXPECT_EQ(gone.Reason(), "CLOTH_NOT_FOUND");
  studio_.FailNextDraw({StatusCode::kResourceExhausted, "DEVICE_MEMORY", "full"});
  EXPECT_EQ(Submit("a", 21).Reason(), "DEVICE_MEMORY");
  EXPECT_TRUE(Submit("a", 22).Get().ok());
  EXPECT_EQ(studio_.makes(), 1);
}

TEST_F(RenderThreadTest, ALostRendererIsMadeAnewAndTheOthersPicturesAreDrawnWithIt) {
  Start();
  studio_.Hold();
  const Outcome lost = Submit("a", 20);
  studio_.WaitForHeldDraw();
  Tracked tracked;
  const Outcome other;
  PictureJob job = Job("b", 21, other);
  job.fetch = [&](bool, const ContentReady& ready) { ready(tracked.NewContent()); };
  Submit(std::move(job), other);
  studio_.FailNextDraw({StatusCode::kUnavailable, kRendererLost, "the device was reset"});
  studio_.Release();
  EXPECT_EQ(lost.Reason(), "RENDERER_LOST");
  EXPECT_TRUE(lost.Get().status().retry_after_ms().has_value());
  EXPECT_TRUE(other.Get().ok());
  EXPECT_EQ(studio_.makes(), 2);
  EXPECT_EQ(studio_.alive(), 1);
}

// Fetched before the loss, delivered after it: the copy belongs to the lost context and is
// destroyed where it was made; the picture is fetched again.
TEST_F(RenderThreadTest, AContentForALostRendererGoesOnTheThreadThatDeliversIt) {
  Start();
  Tracked tracked;
  std::mutex mutex;
  std::vector<ContentReady> asked;
  const auto count = [&] {
    const std::lock_guard lock(mutex);
    return asked.size();
  };
  const Outcome slow;
  PictureJob job = Job("slow", 20, slow);
  job.fetch = [&](bool, const ContentReady& ready) {
    const std::lock_guard lock(mutex);
    asked.push_back(ready);
  };
  Submit(std::move(job), slow);
  while (count() < 1) std::this_thread::yield();
  studio_.FailNextDraw({StatusCode::kUnavailable, kRendererLost, "the device was reset"});
  EXPECT_EQ(Submit("other", 21).Reason(), "RENDERER_LOST");
  while (count() < 2) std::this_thread::yield();
  asked[0](tracked.NewContent());
  EXPECT_EQ(tracked.dropped, 1);
  EXPECT_EQ(tracked.dropped_on.load(), std::this_thread::get_id());
  EXPECT_FALSE(slow.has_value());
  asked[1](tracked.NewContent());
  EXPECT_TRUE(slow.Get().ok());
  EXPECT_EQ(tracked.dropped, 2);
  EXPECT_NE(tracked.dropped_on.load(), std::this_thread::get_id()) << "the render thread's";
}

TEST_F(RenderThreadTest, CancelledPicturesAreNeitherFetchedNorDrawnAndFreeTheirPlaces) {
  Start({.max_pictures_in_flight_per_session = 2, .max_queued_pictures = 3});
  studio_.Hold();
  Submit("drawn", 1);
  studio_.WaitForHeldDraw();
  std::atomic<bool> is_cancelled = false;
  std::atomic<int> fetches = 0;
  std::vector<Outcome> cancelled(2);
  for (uint32_t k = 0; k < 2; ++k) {
    PictureJob job = Job("gone", 20 + k, cancelled[k]);
    job.is_cancelled = [&] { return is_cancelled.load(); };
    job.fetch = [&](bool, const ContentReady& ready) {
      ++fetches;
      ready(PictureContent{});
    };
    Submit(std::move(job), cancelled[k]);
  }
  Submit("other", 40);
  EXPECT_FALSE(Try("gone").ok());
  EXPECT_FALSE(Try("another").ok());
  is_cancelled = true;
  const Outcome after = Submit("gone", 30);
  for (const Outcome& outcome : cancelled) EXPECT_EQ(outcome.Reason(), "CANCELLED");
  studio_.Release();
  EXPECT_TRUE(after.Get().ok());
  EXPECT_EQ(fetches, 0);
  EXPECT_THAT(studio_.drawn(), ElementsAre(1, 40, 30));
}

TEST_F(RenderThreadTest, StopFinishesWhatIsDrawnAndEndsTheRest) {
  Start();
  studio_.Hold();
  const Outcome drawn = Submit("a", 20);
  studio_.WaitForHeldDraw();
  Tracked tracked;
  const Outcome waiting;
  PictureJob job = Job("b", 21, waiting);
  job.fetch = [&](bool, const ContentReady& ready) { ready(tracked.NewContent()); };
  Submit(std::move(job), waiting);
  std::thread stop([this] { thread_->Stop(); });
  while (Try("c").reason() != "DRAINING") std::this_thread::yield();
  studio_.Release();
  stop.join();
  EXPECT_TRUE(drawn.Get().ok());
  EXPECT_EQ(waiting.Get().status().code(), StatusCode::kUnavailable);
  EXPECT_EQ(waiting.Reason(), "DRAINING");
  EXPECT_EQ(studio_.alive(), 0);
  EXPECT_EQ(Try("a").reason(), "DRAINING");
}

TEST_F(RenderThreadTest, AContentThatComesAfterTheEndGoesOnTheThreadThatDeliversIt) {
  Start();
  Tracked tracked;
  const Outcome outcome;
  std::promise<ContentReady> asked;
  PictureJob job = Job("a", 20, outcome);
  job.fetch = [&](bool, const ContentReady& ready) { asked.set_value(ready); };
  Submit(std::move(job), outcome);
  const ContentReady ready = asked.get_future().get();
  thread_.reset();
  EXPECT_EQ(outcome.Reason(), "DRAINING");
  ready(tracked.NewContent());
  EXPECT_EQ(tracked.dropped_on.load(), std::this_thread::get_id());
  EXPECT_EQ(outcome.count(), 1);
}

}  // namespace
}  // namespace drape::render
