#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/scheduler/scheduler_fixture.h"

namespace drape {
namespace {

TEST_F(SchedulerTest, TheFactorysErrorIsReturned) {
  const auto scheduler = Scheduler::Start(
      []() -> Result<std::unique_ptr<Backend>> {
        return Status(StatusCode::kUnavailable, "NO_DEVICE", "no such device");
      },
      {}, clock_);
  ASSERT_FALSE(scheduler.ok());
  EXPECT_EQ(scheduler.status().reason(), "NO_DEVICE");
}

TEST_F(SchedulerTest, TheBackendLivesAndDiesOnTheDeviceThread) {
  Start();
  EXPECT_EQ(scheduler_->description().name, "fake");
  EXPECT_NE(device_->thread(), std::this_thread::get_id());
  scheduler_->Drain(0);
  EXPECT_TRUE(device_->is_destroyed());
  EXPECT_EQ(device_->calls_on_wrong_thread(), 0u);
}

TEST_F(SchedulerTest, SixteenClientsThatWaitTogetherAreOneBatch) {
  Start();
  std::vector<std::shared_ptr<ClothRuntime>> cloths;
  for (int k = 0; k < 16; ++k) cloths.push_back(Cloth());
  scheduler_->HoldForTest();
  std::vector<Awaited<StepOutcome>> outcomes(16);
  std::vector<std::thread> clients;
  for (size_t k = 0; k < 16; ++k) {
    clients.emplace_back(
        [&, k] { outcomes[k] = Submit("client " + std::to_string(k), {cloths[k]}); });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(scheduler_->counters().queued_requests, 16u);
  EXPECT_EQ(scheduler_->counters().rounds, 0u);
  scheduler_->ReleaseForTest();
  for (const auto& outcome : outcomes) {
    EXPECT_TRUE(outcome.Get().status.ok());
    EXPECT_EQ(outcome.Get().timing.batch_requests, 16u);
    EXPECT_EQ(outcome.Get().timing.batch_cloths, 16u);
  }
  EXPECT_EQ(scheduler_->counters().rounds, 1u);
  EXPECT_EQ(scheduler_->counters().dispatches, 1u);
  EXPECT_EQ(scheduler_->counters().cloth_steps, 16u);
  EXPECT_EQ(scheduler_->counters().queued_requests, 0u);
}

TEST_F(SchedulerTest, WhatOneCallerPostsAndSubmitsIsTakenInOrder) {
  Start();
  const auto cloth = Cloth();
  scheduler_->HoldForTest();
  std::vector<std::string> order;  // device thread, then after the last Get
  ASSERT_TRUE(scheduler_->Post("a", [&](Backend&) { order.push_back("first command"); }).ok());
  ASSERT_TRUE(scheduler_->Post("a", [&](Backend&) { order.push_back("second command"); }).ok());
  device_->OnStep([&] { order.push_back("step"); });
  const auto outcome = Submit("a", {cloth});
  scheduler_->ReleaseForTest();
  outcome.Get();
  EXPECT_EQ(order, (std::vector<std::string>{"first command", "second command", "step"}));
}

TEST_F(SchedulerTest, CompletionsComeInOrderOnOneOtherThread) {
  Start();
  std::vector<std::shared_ptr<ClothRuntime>> cloths;
  for (int k = 0; k < 20; ++k) cloths.push_back(Cloth());
  scheduler_->HoldForTest();
  std::vector<int> order;
  std::vector<std::thread::id> threads;
  Awaited<bool> all;
  for (int k = 0; k < 20; ++k) {
    StepWork work;
    work.session = "a";
    work.cloths = {cloths[static_cast<size_t>(k)]};
    work.steps = 1;
    work.done = [&, k, all](const StepOutcome&) mutable {
      order.push_back(k);
      threads.push_back(std::this_thread::get_id());
      if (k == 19) all.Set(true);
    };
    ASSERT_TRUE(scheduler_->Submit(std::move(work)).ok());
  }
  scheduler_->ReleaseForTest();
  all.Get();
  for (size_t k = 0; k < 20; ++k) {
    EXPECT_EQ(order[k], static_cast<int>(k));
    // With the last one nothing is left to do, so the device thread may have called it itself.
    if (k == 19 && threads[k] == device_->thread()) continue;
    EXPECT_EQ(threads[k], threads[0]);
    EXPECT_NE(threads[k], device_->thread());
  }
}

// A client that has its next request on the way keeps the device busy.
TEST_F(SchedulerTest, TheNextRequestOfAClothDoesNotWaitForTheAnswerToTheOneBefore) {
  Start();
  const auto cloth = Cloth();
  scheduler_->HoldForTest();
  Awaited<bool> second_step;
  int steps = 0;  // device thread
  device_->OnStep([&] {
    if (++steps == 2) second_step.Set(true);
  });
  StepWork work;
  work.session = "a";
  work.cloths = {cloth};
  work.steps = 1;
  work.done = [second_step](const StepOutcome&) { second_step.Get(); };
  ASSERT_TRUE(scheduler_->Submit(std::move(work)).ok());
  const auto second = Submit("a", {cloth});
  scheduler_->ReleaseForTest();
  EXPECT_EQ(second.Get().cloths[0].stamp.completed_steps, 2u);
}

TEST_F(SchedulerTest, AClientThatGoesAwayEndsItsRequestAlone) {
  Start();
  const auto a = Cloth(), b = Cloth();
  CancelToken token;
  Awaited<bool> is_running;
  device_->OnStep([is_running]() mutable { is_running.Set(true); });
  const auto gone = Submit("gone", {a}, 1000000, token);
  is_running.Get();
  const auto stays = Submit("stays", {b}, 10);
  token.Cancel();
  EXPECT_EQ(gone.Get().status.code(), StatusCode::kCancelled);
  EXPECT_TRUE(stays.Get().status.ok());
  EXPECT_EQ(b->progress().completed_steps, 10u);
  EXPECT_LT(a->progress().completed_steps, 1000000u);
}

TEST_F(SchedulerTest, DrainFinishesWhatWasTakenAndRefusesMore) {
  Start();
  const auto cloth = Cloth();
  scheduler_->HoldForTest();
  const auto outcome = Submit("a", {cloth}, 50);
  scheduler_->Drain(1000000);
  EXPECT_TRUE(outcome.has_value());
  EXPECT_TRUE(outcome.Get().status.ok());
  EXPECT_EQ(cloth->progress().completed_steps, 50u);
  EXPECT_TRUE(scheduler_->is_draining());
  EXPECT_EQ(TrySubmit("a", cloth).reason(), "DRAINING");
  EXPECT_EQ(scheduler_->Post("a", [](Backend&) {}).reason(), "DRAINING");
  EXPECT_FALSE(scheduler_->PostCleanup("a", [](Backend&) {}));
  EXPECT_EQ(scheduler_->RunBlocking([](Backend&) { return Status::Ok(); }).reason(), "DRAINING");
}

TEST_F(SchedulerTest, DrainEndsWhatTakesTooLong) {
  Start();
  const auto cloth = Cloth();
  device_->OnStep([this] { clock_.AdvanceUs(1000); });
  scheduler_->HoldForTest();
  const auto outcome = Submit("a", {cloth}, 1000000);
  scheduler_->Drain(20000);
  ASSERT_TRUE(outcome.has_value());
  EXPECT_EQ(outcome.Get().status.code(), StatusCode::kUnavailable);
  EXPECT_EQ(outcome.Get().status.reason(), "DRAINING");
  EXPECT_EQ(cloth->progress().completed_steps, 20u);  // 20 ms of 1 ms each
}

TEST_F(SchedulerTest, AHurryEndsTheGraceOfADrain) {
  Start();
  const auto cloth = Cloth();
  CancelToken hurry;
  int steps = 0;  // device thread
  device_->OnStep([&] {
    if (++steps == 20) hurry.Cancel();
  });
  scheduler_->HoldForTest();
  const auto outcome = Submit("a", {cloth}, 1000000);
  bool is_last_run = false;
  scheduler_->Drain(
      INT64_MAX / 2, [&](Backend&) { is_last_run = true; }, hurry);
  ASSERT_TRUE(outcome.has_value());
  EXPECT_EQ(outcome.Get().status.reason(), "DRAINING");
  EXPECT_EQ(cloth->progress().completed_steps, 20u);
  EXPECT_TRUE(is_last_run);
}

TEST_F(SchedulerTest, ReadStatesReadsBetweenTwoRounds) {
  Start();
  const auto a = Cloth(), b = Cloth();
  Submit("a", {b}, 3).Get();
  Awaited<Result<ClothStates>> read;
  ASSERT_TRUE(scheduler_
                  ->ReadStates({a, b}, {true, false},
                               [read](Result<ClothStates> r) mutable { read.Set(std::move(r)); })
                  .ok());
  const ClothStates& states = read.Get().value();
  EXPECT_EQ(states.cloths[1].completed_steps, 3u);
  EXPECT_EQ(states.cloths[1].time_s, 0.75);
  EXPECT_EQ(std::get<std::vector<double>>(states.columns.positions_m),
            (std::vector<double>{0, 0, 0, 1, 0, 0, 0, -3, 0, 1, -3, 0}));
}

TEST_F(SchedulerTest, ReadStatesOfADeletedClothIsNotFound) {
  Start();
  const auto cloth = Cloth();
  ASSERT_TRUE(scheduler_
                  ->RunBlocking([&](Backend& backend) {
                    cloth->End({StatusCode::kNotFound, "CLOTH_NOT_FOUND", ""});
                    backend.Destroy(cloth->handle());
                    return Status::Ok();
                  })
                  .ok());
  Awaited<Result<ClothStates>> read;
  ASSERT_TRUE(scheduler_
                  ->ReadStates({cloth}, {true, false},
                               [read](Result<ClothStates> r) mutable { read.Set(std::move(r)); })
                  .ok());
  EXPECT_EQ(read.Get().status().reason(), "CLOTH_NOT_FOUND");
}

TEST_F(SchedulerTest, ReadsAreBoundedUntilTheirStatesAreDropped) {
  SchedulerLimits limits;
  limits.max_reads_in_flight_per_session = 1;
  Start(limits);
  const auto cloth = Cloth();
  const auto read = [&](const std::string& session, Awaited<Result<ClothStates>> result) {
    return scheduler_->ReadStates(
        {cloth}, {true, false},
        [result](Result<ClothStates> r) mutable { result.Set(std::move(r)); }, session);
  };
  const Awaited<Result<ClothStates>> first;
  ASSERT_TRUE(read("a", first).ok());
  first.Get();
  const Status refused = read("a", {});
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(refused.reason(), "TOO_MANY_READS");
  EXPECT_EQ(refused.retry_after_ms(), limits.retry_after_ms);
  EXPECT_TRUE(read("b", {}).ok());
  first.Get()->in_flight.reset();
  EXPECT_TRUE(read("a", {}).ok());
}

// If the caller accepts no copy, or the backend makes none, the columns come instead.
TEST_F(SchedulerTest, ReadForDrawingGivesACopyOnTheDeviceWhereThatWillDo) {
  Start();
  const auto cloth = Cloth();
  Submit("a", {cloth}, 3).Get();
  const auto read = [&](bool on_device) {
    Awaited<Result<ClothStates>> result;
    Awaited<std::thread::id> thread;
    const auto done = [result, thread](Result<ClothStates> r) mutable {
      thread.Set(std::this_thread::get_id());
      result.Set(std::move(r));
    };
    EXPECT_TRUE(scheduler_->ReadForDrawing({cloth}, {true, false}, on_device, done, "a").ok());
    EXPECT_EQ(thread.Get(), device_->thread());
    return std::move(result.Get()).value();
  };
  const std::vector<double> positions{0, -3, 0, 1, -3, 0};
  EXPECT_EQ(std::get<std::vector<double>>(read(true).columns.positions_m), positions);
  const auto copy = std::make_shared<int>(0);
  device_->MakeCopies(copy);
  const ClothStates on_host = read(false);
  EXPECT_EQ(on_host.on_device, nullptr);
  EXPECT_EQ(std::get<std::vector<double>>(on_host.columns.positions_m), positions);
  const ClothStates on_device = read(true);
  EXPECT_NE(on_device.on_device, nullptr);
  EXPECT_EQ(on_device.cloths.at(0).completed_steps, 3u);
  EXPECT_EQ(device_->reads().size(), 2u) << "no read for the copy";
}

TEST_F(SchedulerTest, ReadForDrawingCountsAsAReadAndNeedsLivingCloths) {
  SchedulerLimits limits;
  limits.max_reads_in_flight_per_session = 1;
  Start(limits);
  const auto cloth = Cloth();
  const auto read = [&](Awaited<Result<ClothStates>> result) {
    return scheduler_->ReadForDrawing(
        {cloth}, {true, false}, true,
        [result](Result<ClothStates> r) mutable { result.Set(std::move(r)); }, "a");
  };
  const Awaited<Result<ClothStates>> first, second;
  ASSERT_TRUE(read(first).ok());
  first.Get();
  EXPECT_EQ(read({}).reason(), "TOO_MANY_READS");
  first.Get()->in_flight.reset();
  ASSERT_TRUE(scheduler_
                  ->RunBlocking([&](Backend& backend) {
                    cloth->End({StatusCode::kNotFound, "CLOTH_NOT_FOUND", ""});
                    backend.Destroy(cloth->handle());
                    return Status::Ok();
                  })
                  .ok());
  ASSERT_TRUE(read(second).ok());
  EXPECT_EQ(second.Get().status().reason(), "CLOTH_NOT_FOUND");
}

TEST_F(SchedulerTest, SubscriptionsAreBoundedUntilTheyHaveEnded) {
  SchedulerLimits limits;
  limits.max_observers_per_session = 1;
  limits.max_observers = 2;
  Start(limits);
  ObserverSpec spec;
  spec.session = "a";
  spec.cloths = {Cloth()};
  spec.fields = {true, false};
  spec.on_frame = [](const ObservedFrame&) {};
  spec.on_end = [](const Status&) {};
  auto observer = scheduler_->Subscribe(spec).value();
  const Status refused = scheduler_->Subscribe(spec).status();
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(refused.reason(), "TOO_MANY_SUBSCRIPTIONS");
  spec.session = "b";
  const auto other = scheduler_->Subscribe(spec).value();
  spec.session = "c";
  EXPECT_EQ(scheduler_->Subscribe(spec).status().reason(), "TOO_MANY_SUBSCRIPTIONS");
  observer->Cancel();
  observer.reset();
  spec.session = "a";
  while (!scheduler_->Subscribe(spec).ok()) std::this_thread::yield();
}

TEST_F(SchedulerTest, ASubscriptionGetsFramesUntilItEnds) {
  Start();
  const auto cloth = Cloth();
  Awaited<ObservedFrame> last;
  Awaited<Status> end;
  ObserverSpec spec;
  spec.cloths = {cloth};
  spec.fields = {true, false};
  spec.initial_credit = 1000;
  spec.on_frame = [last](ObservedFrame frame) mutable {
    frame.in_flight.reset();
    if (frame.content->states.cloths[0].completed_steps == 30) last.Set(std::move(frame));
  };
  spec.on_end = [end](const Status& status) mutable { end.Set(status); };
  const auto observer = scheduler_->Subscribe(spec).value();
  Submit("a", {cloth}, 30).Get();
  const ObservedFrame& frame = last.Get();
  EXPECT_GE(frame.frame, 1u);
  EXPECT_LE(frame.frame, 31u);
  observer->Cancel();
  EXPECT_EQ(end.Get().code(), StatusCode::kCancelled);
}

TEST_F(SchedulerTest, CreditAloneWakesTheDeviceThread) {
  Start();
  const auto cloth = Cloth();
  Awaited<ObservedFrame> frame;
  ObserverSpec spec;
  spec.cloths = {cloth};
  spec.fields = {true, true};
  spec.on_frame = [frame](ObservedFrame f) mutable { frame.Set(std::move(f)); };
  spec.on_end = [](const Status&) {};
  const auto observer = scheduler_->Subscribe(spec).value();
  observer->AddCredit(1);
  EXPECT_EQ(frame.Get().content->states.cloths[0].completed_steps, 0u);
}

TEST_F(SchedulerTest, ARateLimitedFrameComesWithoutAnotherStep) {
  const SteadyClock clock;
  scheduler_ = Scheduler::Start(FakeBackendFactory(device_), {}, clock).value();
  const auto cloth = Cloth();
  Awaited<ObservedFrame> last;
  ObserverSpec spec;
  spec.cloths = {cloth};
  spec.fields = {true, false};
  spec.max_hz = 50;
  spec.initial_credit = 1000;
  spec.on_frame = [last](ObservedFrame frame) mutable {
    if (frame.content->states.cloths[0].completed_steps == 5) last.Set(std::move(frame));
  };
  spec.on_end = [](const Status&) {};
  const auto observer = scheduler_->Subscribe(spec).value();
  Submit("a", {cloth}, 5).Get();
  EXPECT_LE(last.Get().frame, 6u);
  scheduler_.reset();  // before the clock
}

TEST_F(SchedulerTest, DrainEndsSubscriptions) {
  Start();
  const auto cloth = Cloth();
  Awaited<Status> end;
  ObserverSpec spec;
  spec.cloths = {cloth};
  spec.fields = {true, false};
  spec.on_frame = [](const ObservedFrame&) {};
  spec.on_end = [end](const Status& status) mutable { end.Set(status); };
  const auto observer = scheduler_->Subscribe(spec).value();
  scheduler_->Drain(0);
  EXPECT_EQ(end.Get().reason(), "DRAINING");
  scheduler_.reset();
  observer->AddCredit(1);  // harmless after the end
}

// Many clients at once, each with its own cloths, some giving up: every request ends exactly once
// and every cloth has as many steps as its own requests asked for.
TEST_F(SchedulerTest, ManyClientsAtOnce) {
  SchedulerLimits limits;
  limits.max_cloths_per_batch = 5;
  limits.max_queued_requests_per_session = 1000;
  Start(limits);
  std::vector<std::shared_ptr<ClothRuntime>> cloths;
  for (int k = 0; k < 8; ++k) cloths.push_back(Cloth());
  std::atomic<int> ended{0};
  std::vector<std::thread> clients;
  for (size_t k = 0; k < 8; ++k) {
    clients.emplace_back([&, k] {
      for (uint32_t r = 1; r <= 50; ++r) {
        StepWork work;
        work.session = "client " + std::to_string(k % 4);
        work.cloths = {cloths[k]};
        work.steps = 1 + r % 3;
        work.done = [&](const StepOutcome& outcome) {
          EXPECT_TRUE(outcome.status.ok());
          ++ended;
        };
        const Status status = scheduler_->Submit(std::move(work));
        EXPECT_TRUE(status.ok()) << status.ToString();
      }
    });
  }
  for (std::thread& client : clients) client.join();
  scheduler_->Drain(1000000000);
  EXPECT_EQ(ended, 400);
  // The sum of 1 + r % 3 for r = 1 .. 50: 50 + 17 * 1 + 17 * 2 + 16 * 0.
  for (const auto& cloth : cloths) EXPECT_EQ(cloth->progress().completed_steps, 101u);
}

class AnswerThreadTest : public SchedulerTest {
 protected:
  // The thread on which the answer to one step of the cloth is given.
  Awaited<std::thread::id> ThreadOfAnswer(const std::string& session,
                                          const std::shared_ptr<ClothRuntime>& cloth,
                                          StateFields view = {}) {
    Awaited<std::thread::id> thread;
    StepWork work;
    work.session = session;
    work.cloths = {cloth};
    work.steps = 1;
    work.view = view;
    work.done = [thread](const StepOutcome& outcome) mutable {
      EXPECT_TRUE(outcome.status.ok());
      thread.Set(std::this_thread::get_id());
    };
    EXPECT_TRUE(scheduler_->Submit(std::move(work)).ok());
    return thread;
  }

  std::thread::id DeviceThread() {
    std::thread::id thread;
    EXPECT_TRUE(scheduler_
                    ->RunBlocking([&](Backend&) {
                      thread = std::this_thread::get_id();
                      return Status::Ok();
                    })
                    .ok());
    return thread;
  }
};

TEST_F(AnswerThreadTest, TheDeviceThreadGivesTheLastAnswerItself) {
  Start();
  const std::thread::id device_thread = DeviceThread();
  const auto first_cloth = Cloth(), second_cloth = Cloth();
  EXPECT_EQ(ThreadOfAnswer("a", first_cloth).Get(), device_thread);
  scheduler_->HoldForTest();
  const auto first = ThreadOfAnswer("a", first_cloth), second = ThreadOfAnswer("b", second_cloth);
  scheduler_->ReleaseForTest();
  EXPECT_NE(first.Get(), device_thread) << "the answer of b was to be given next";
  second.Get();
}

TEST_F(AnswerThreadTest, LongAnswersAreNotGivenOnTheDeviceThread) {
  Start();
  const std::thread::id device_thread = DeviceThread();
  std::shared_ptr<ClothRuntime> cloth;
  ASSERT_TRUE(scheduler_
                  ->RunBlocking([&](Backend& backend) {
                    cloth = BeginCloth(backend, ChainModel((1u << 16) + 1));
                    return Status::Ok();
                  })
                  .ok());
  EXPECT_EQ(ThreadOfAnswer("a", cloth).Get(), device_thread) << "without states it is short";
  EXPECT_NE(ThreadOfAnswer("a", cloth, {true, false}).Get(), device_thread);
}

}  // namespace
}  // namespace drape
