#include "server/scheduler/device_loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/scheduler/device_loop_fixture.h"
#include "tests/support/plain_settings.h"

namespace drape {
namespace {

using Eigen::Vector3d;

TEST_F(DeviceLoopTest, RequestsThatWaitTogetherAreOneBatch) {
  const auto a = Cloth(), b = Cloth(), c = Cloth();
  Admit(Work("x", {a, b}));
  Admit(Work("y", {c}));
  loop_->RunRound();
  ASSERT_EQ(device_->batches().size(), 1u);
  EXPECT_EQ(device_->batches()[0].size(), 3u);
  EXPECT_EQ(ended_, (std::vector<std::string>{"x", "y"}));
  EXPECT_EQ(outcomes_["x"].timing.batch_cloths, 3u);
  EXPECT_EQ(outcomes_["x"].timing.batch_requests, 2u);
  EXPECT_EQ(outcomes_["x"].timing.batch_dispatches, 1u);
}

// Each takes 40 of the 50 ms of a batch: between two of them the cheap cloth has its step.
TEST_F(DeviceLoopTest, CostlyClothsAreSteppedOneByOne) {
  std::vector<std::shared_ptr<ClothRuntime>> costly;
  for (int k = 0; k < 8; ++k) costly.push_back(Cloth());
  Restart(64);
  TakeFor(costly, 40'000);
  Admit(Work("costly", costly));
  RunAll();  // nothing is known about them yet
  Admit(Work("costly", costly));
  const auto cheap = Cloth();
  Admit(Work("cheap", {cheap}, 4));
  const size_t before = device_->batches().size();
  ended_.clear();
  RunAll();
  EXPECT_EQ(ended_, (std::vector<std::string>{"cheap", "costly"}));
  const std::vector<FakeBatch> batches = device_->batches();
  for (size_t k = before; k < batches.size(); ++k) EXPECT_LE(batches[k].size(), 2u);
}

TEST_F(DeviceLoopTest, LongRequestsAreJoinedAndLeftByShortOnes) {
  const auto a = Cloth(), b = Cloth();
  Admit(Work("long", {a}, 100));
  for (int round = 0; round < 10; ++round) loop_->RunRound();
  Admit(Work("short", {b}, 5));
  RunAll();
  EXPECT_EQ(ended_, (std::vector<std::string>{"short", "long"}));
  const auto batches = device_->batches();
  ASSERT_EQ(batches.size(), 100u);
  for (size_t k = 0; k < 100; ++k) EXPECT_EQ(batches[k].size(), k >= 10 && k < 15 ? 2u : 1u) << k;
  EXPECT_EQ(outcomes_["long"].cloths[0].stamp.completed_steps, 100u);
  EXPECT_EQ(outcomes_["long"].cloths[0].stamp.time_s, 25.0);
}

TEST_F(DeviceLoopTest, ASecondRequestForAClothWaitsItsTurn) {
  const auto a = Cloth(), b = Cloth();
  Admit(Work("first", {a}, 3));
  Admit(Work("second", {a, b}, 2));
  Admit(Work("third", {b}, 1));  // behind the second although b is idle
  RunAll();
  EXPECT_EQ(ended_, (std::vector<std::string>{"first", "second", "third"}));
  for (const FakeBatch& batch : device_->batches()) {
    for (size_t k = 1; k < batch.size(); ++k) EXPECT_NE(batch[k].cloth, batch[0].cloth);
  }
  EXPECT_EQ(a->now().completed_steps, 5u);
  EXPECT_EQ(b->now().completed_steps, 3u);
}

TEST_F(DeviceLoopTest, ExpectedStepIsCheckedWhenTheRequestStarts) {
  const auto a = Cloth();
  Admit(Work("first", {a}, 3));
  StepWork fits = Work("fits", {a});
  fits.expected_step = 3;  // not true yet
  Admit(fits);
  StepWork late = Work("late", {a});
  late.expected_step = 3;
  Admit(late);
  RunAll();
  EXPECT_TRUE(outcomes_["fits"].status.ok());
  EXPECT_EQ(outcomes_["late"].status.code(), StatusCode::kFailedPrecondition);
  EXPECT_EQ(outcomes_["late"].status.reason(), "STEP_MISMATCH");
  EXPECT_EQ(a->now().completed_steps, 4u);
}

TEST_F(DeviceLoopTest, AMismatchOfOneClothMovesNone) {
  const auto a = Cloth(), b = Cloth();
  Admit(Work("ahead", {b}));
  RunAll();
  StepWork work = Work("work", {a, b});
  work.expected_step = 0;
  Admit(work);
  RunAll();
  EXPECT_EQ(outcomes_["work"].status.reason(), "STEP_MISMATCH");
  EXPECT_EQ(a->now().completed_steps, 0u);
}

TEST_F(DeviceLoopTest, ARequestMustStartBeforeItsDeadline) {
  const auto a = Cloth(), b = Cloth();
  Admit(Work("first", {a}, 3));
  StepWork late = Work("late", {a, b});
  late.deadline_us = clock_.NowUs() + 20;
  Admit(late);
  StepWork begun = Work("begun", {b}, 100);
  begun.deadline_us = clock_.NowUs() + 20;
  Admit(Work("behind", {a}));
  loop_->RunRound();
  clock_.AdvanceUs(20);
  loop_->RunRound();
  EXPECT_EQ(ended_, std::vector<std::string>{"late"});
  EXPECT_EQ(outcomes_["late"].status.code(), StatusCode::kCancelled);
  EXPECT_EQ(outcomes_["late"].status.reason(), "DEADLINE_PASSED");
  begun.deadline_us = clock_.NowUs() + 20;
  Admit(begun);
  loop_->RunRound();
  clock_.AdvanceUs(1000);
  RunAll();
  EXPECT_TRUE(outcomes_["begun"].status.ok()) << "what has begun is for its caller to cancel";
  EXPECT_TRUE(outcomes_["behind"].status.ok());
  EXPECT_EQ(a->now().completed_steps, 4u);
  EXPECT_EQ(b->now().completed_steps, 100u);
}

TEST_F(DeviceLoopTest, UntilStepBringsEveryClothThere) {
  const auto a = Cloth(), b = Cloth(), c = Cloth();
  Admit(Work("ahead", {b}, 2));
  Admit(Work("there", {c}, 5));
  RunAll();
  StepWork work = Work("until", {a, b, c});
  work.steps.reset();
  work.until_step = 5;
  work.report = true;
  Admit(work);
  RunAll();
  const StepOutcome& outcome = outcomes_["until"];
  ASSERT_TRUE(outcome.status.ok());
  for (const ClothOutcome& cloth : outcome.cloths) EXPECT_EQ(cloth.stamp.completed_steps, 5u);
  EXPECT_TRUE(outcome.cloths[0].report.has_value());
  EXPECT_TRUE(outcome.cloths[1].report.has_value());
  EXPECT_FALSE(outcome.cloths[2].report.has_value());
}

TEST_F(DeviceLoopTest, UntilStepBehindOrTooFarAheadIsRefused) {
  const auto a = Cloth();
  Admit(Work("ahead", {a}, 2));
  RunAll();
  StepWork behind = Work("behind", {a});
  behind.steps.reset();
  behind.until_step = 1;
  Admit(behind);
  StepWork far = Work("far", {a});
  far.steps.reset();
  far.until_step = 1003;  // 1001 ahead, the limit is 1000
  Admit(far);
  RunAll();
  EXPECT_EQ(outcomes_["behind"].status.reason(), "STEP_MISMATCH");
  EXPECT_EQ(outcomes_["far"].status.code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(outcomes_["far"].status.violations()[0].field, "until_step");
  EXPECT_EQ(a->now().completed_steps, 2u);
}

TEST_F(DeviceLoopTest, OnlyTheLastStepIsMeasured) {
  const auto a = Cloth();
  StepWork work = Work("work", {a}, 3);
  work.report = true;
  Admit(work);
  RunAll();
  const auto batches = device_->batches();
  EXPECT_FALSE(batches[0][0].measure);
  EXPECT_FALSE(batches[1][0].measure);
  EXPECT_TRUE(batches[2][0].measure);
  EXPECT_EQ(outcomes_["work"].cloths[0].report->measured.kinetic_energy_j, 3);
  EXPECT_EQ(outcomes_["work"].cloths[0].warnings.not_converged, 3u);
}

TEST_F(DeviceLoopTest, AFaultEndsTheClothsPartAndNobodyElses) {
  const auto bad = Cloth(), good = Cloth();
  StepWork work = Work("work", {bad, good}, 4);
  work.report = true;
  work.view = {true, false};
  Admit(work);
  loop_->RunRound();
  device_->FaultNextStep(bad->handle());
  RunAll();
  const StepOutcome& outcome = outcomes_["work"];
  ASSERT_TRUE(outcome.status.ok());
  EXPECT_EQ(outcome.cloths[0].stamp.fault, FaultReason::kNotFinite);
  EXPECT_EQ(outcome.cloths[0].stamp.completed_steps, 1u);
  EXPECT_EQ(outcome.cloths[0].report->fault, FaultReason::kNotFinite);
  EXPECT_EQ(outcome.cloths[0].report->measured.kinetic_energy_j, 1);  // of its last good state
  EXPECT_EQ(outcome.cloths[1].stamp.completed_steps, 4u);
  EXPECT_EQ(counters_.faults, 1u);
  // The last good state stays readable.
  const auto& positions = std::get<std::vector<double>>(outcome.states->positions_m);
  EXPECT_EQ(positions, (std::vector<double>{0, -1, 0, 1, -1, 0, 0, -4, 0, 1, -4, 0}));
}

TEST_F(DeviceLoopTest, AFaultedClothIsReportedAndLeftOutOfExpectations) {
  const auto bad = Cloth(), good = Cloth();
  device_->FaultNextStep(bad->handle());
  Admit(Work("fault", {bad, good}, 2));
  RunAll();
  StepWork work = Work("work", {bad, good});
  work.expected_step = 2;
  work.report = true;
  Admit(work);
  RunAll();
  ASSERT_TRUE(outcomes_["work"].status.ok());
  EXPECT_EQ(outcomes_["work"].cloths[0].report->fault, FaultReason::kNotFinite);
  EXPECT_EQ(outcomes_["work"].cloths[1].stamp.completed_steps, 3u);
  // All faulted and no report wanted: nothing to step.
  const size_t batches = device_->batches().size();
  Admit(Work("nothing", {bad}, 7));
  RunAll();
  EXPECT_TRUE(outcomes_["nothing"].status.ok());
  EXPECT_EQ(device_->batches().size(), batches);
}

TEST_F(DeviceLoopTest, PinsMoveFromTheStartOfTheRequest) {
  const auto a = Cloth({0});
  Admit(Work("before", {a}, 4));  // 1 s
  StepWork work = Work("move", {a}, 4);
  work.controls.pins = {{0, {0, Vector3d(0, 8, 0), 0.5}}};
  Admit(work);
  RunAll();
  const auto batches = device_->batches();
  ASSERT_EQ(batches.size(), 8u);
  EXPECT_EQ(batches[0][0].pin_targets_m, (std::vector<Vector3d>{{0, 0, 0}}));  // as created
  for (const size_t idle : {1, 2, 3, 6, 7}) EXPECT_TRUE(batches[idle][0].pin_targets_m.empty());
  EXPECT_EQ(batches[4][0].pin_targets_m, (std::vector<Vector3d>{{0, 4, 0}}));
  EXPECT_EQ(batches[5][0].pin_targets_m, (std::vector<Vector3d>{{0, 8, 0}}));
}

TEST_F(DeviceLoopTest, APinThatIsNoneAnyMoreEndsTheRequestUntouched) {
  const auto a = Cloth({0});
  StepWork work = Work("work", {a});
  work.controls.pins = {{0, {0, Vector3d(0, 8, 0), 0}}, {0, {1, Vector3d::Zero(), 0}}};
  Admit(work);
  RunAll();
  EXPECT_EQ(outcomes_["work"].status.code(), StatusCode::kFailedPrecondition);
  EXPECT_EQ(outcomes_["work"].status.reason(), "PIN_NOT_FOUND");
  EXPECT_EQ(a->controls().pins().motion(0).At(100),
            Vector3d(0, 0, 0));  // the first control is not half applied
}

// The backend has motions from the first control on; the colliders that are shown follow the time.
TEST_F(DeviceLoopTest, CollidersMoveFromTheStartOfTheRequest) {
  const auto a = Cloth();
  a->controls().StartColliders({}, {Vector3d(1, 0, 0), Vector3d(0, 0, 0)}, 0);
  Admit(Work("before", {a}, 4));  // 1 s
  StepWork work = Work("move", {a}, 1);
  work.controls.colliders = {{0, {1, {.position_m = Vector3d(0, 8, 0)}, 0.5}}};
  Admit(work);
  RunAll();
  const auto motions = [&]() -> const std::vector<RigidMotion>& {
    return backend_.ParametersOf(a->handle()).collider_motions;
  };
  ASSERT_EQ(motions().size(), 2u);
  EXPECT_EQ(motions()[1].position_m, Vector3d(0, 0, 0));
  EXPECT_EQ(motions()[1].velocity_m_per_s, Vector3d(0, 16, 0));
  EXPECT_EQ(motions()[0].velocity_m_per_s, Vector3d::Zero());
  EXPECT_EQ(a->collider_motions()[1].position_m, Vector3d(0, 4, 0));
  Admit(Work("on", {a}, 2));
  RunAll();
  EXPECT_EQ(motions()[1].position_m, Vector3d(0, 8, 0));
  EXPECT_EQ(motions()[1].velocity_m_per_s, Vector3d::Zero());
}

TEST_F(DeviceLoopTest, AColliderThatIsNoneAnyMoreEndsTheRequestUntouched) {
  const auto a = Cloth();
  a->controls().StartColliders({}, {Vector3d(1, 0, 0)}, 0);
  StepWork work = Work("work", {a});
  work.controls.colliders = {{0, {0, {.position_m = Vector3d(0, 8, 0)}, 0}},
                             {0, {1, {.position_m = Vector3d(0, 8, 0)}, 0}}};
  Admit(work);
  RunAll();
  EXPECT_EQ(outcomes_["work"].status.code(), StatusCode::kFailedPrecondition);
  EXPECT_EQ(outcomes_["work"].status.reason(), "COLLIDER_NOT_FOUND");
  EXPECT_FALSE(a->controls().colliders().is_moving());
  EXPECT_EQ(a->now().completed_steps, 0u);
}

TEST_F(DeviceLoopTest, WithoutRoomForMovingCollidersNothingMoves) {
  const auto a = Cloth({0});
  a->controls().StartColliders({}, {Vector3d(1, 0, 0)}, 0);
  StepWork work = Work("work", {a});
  work.controls.pins = {{0, {0, Vector3d(0, 8, 0), 0}}};
  work.controls.colliders = {{0, {0, {.position_m = Vector3d(0, 8, 0)}, 0}}};
  device_->FailWrite(0);
  Admit(work);
  RunAll();
  EXPECT_EQ(outcomes_["work"].status.code(), StatusCode::kResourceExhausted);
  EXPECT_FALSE(a->controls().colliders().is_moving());
  EXPECT_EQ(a->controls().pins().motion(0).At(100), Vector3d(0, 0, 0));
}

TEST_F(DeviceLoopTest, StatesOfTheBatchAreReadTogether) {
  const auto a = Cloth(), b = Cloth();
  StepWork one = Work("one", {a});
  one.view = {true, false};
  StepWork two = Work("two", {b});
  two.view = {true, false};
  Admit(one);
  Admit(two);
  RunAll();
  EXPECT_EQ(device_->reads(), std::vector<size_t>{2});
  EXPECT_EQ(std::get<std::vector<double>>(outcomes_["two"].states->positions_m),
            (std::vector<double>{0, -1, 0, 1, -1, 0}));
  EXPECT_EQ(std::get<std::vector<double>>(outcomes_["one"].states->positions_m).size(), 6u);
}

TEST_F(DeviceLoopTest, ThoseWhoWantTheSameParticlesShareOneRead) {
  const StateFields all{true, false}, first{true, false, {0}}, second{true, false, {1}};
  const std::vector<StateFields> views{first, second, all, first, {}, {false, true, {0}}};
  for (size_t k = 0; k < views.size(); ++k) {
    StepWork work = Work(std::to_string(k), {Cloth()});
    work.view = views[k];
    Admit(work);
  }
  RunAll();
  EXPECT_THAT(device_->reads(), testing::UnorderedElementsAre(2, 1, 1, 1));
  const auto positions = [&](const std::string& name) {
    return std::get<std::vector<double>>(outcomes_[name].states->positions_m);
  };
  EXPECT_EQ(positions("0"), (std::vector<double>{0, -1, 0}));
  EXPECT_EQ(positions("3"), (std::vector<double>{0, -1, 0}));
  EXPECT_EQ(positions("1"), (std::vector<double>{1, -1, 0}));
  EXPECT_EQ(positions("2"), (std::vector<double>{0, -1, 0, 1, -1, 0}));
  EXPECT_FALSE(outcomes_["4"].states.has_value());
  EXPECT_EQ(std::get<std::vector<double>>(outcomes_["5"].states->velocities_m_per_s).size(), 3u);
}

TEST_F(DeviceLoopTest, StatesAreThoseOfTheRequestsOwnLastStep) {
  const auto a = Cloth();
  StepWork one = Work("one", {a});
  one.view = {true, true};
  Admit(one);
  Admit(Work("two", {a}, 5));
  RunAll();
  EXPECT_EQ(std::get<std::vector<double>>(outcomes_["one"].states->positions_m)[1], -1);
  EXPECT_EQ(a->now().completed_steps, 6u);
}

// Several times over, as of a stream whose requests wait for each other.
TEST_F(DeviceLoopTest, WhatTheNextRequestStartsAgainIsToldBefore) {
  const auto a = Cloth();
  const std::vector<Vector3d> start_m{{0, 5, 0}, {1, 5, 0}};
  for (const int k : {0, 1, 2}) {
    StepWork work = Work(std::to_string(k), {a}, 3);
    work.view = {true, false};
    work.restarts = {RestartPoint{}};
    work.restart = [a, start_m](Backend& backend) {
      ClothUpdate update;
      update.state = ParticleState{start_m, std::vector<Vector3d>(2, Vector3d::Zero())};
      a->Reset({}, {});
      return backend.Write(a->handle(), update);
    };
    Admit(work);
  }
  RunAll();
  EXPECT_EQ(ended_, (std::vector<std::string>{"0", "1", "2"}));
  for (const auto& [name, outcome] : outcomes_) {
    EXPECT_EQ(outcome.cloths[0].stamp.completed_steps, 3u) << name;
    EXPECT_EQ(std::get<std::vector<double>>(outcome.states->positions_m)[1], 2) << name;
  }
}

TEST_F(DeviceLoopTest, ACancelledRequestEndsAfterTheRoundAndFreesItsCloths) {
  const auto a = Cloth(), b = Cloth();
  StepWork work = Work("work", {a}, 100);
  CancelToken token = work.cancel;
  Admit(std::move(work));
  Admit(Work("next", {a, b}));
  loop_->RunRound();
  loop_->RunRound();
  token.Cancel();
  loop_->RunRound();
  EXPECT_EQ(outcomes_["work"].status.code(), StatusCode::kCancelled);
  EXPECT_TRUE(outcomes_["next"].status.ok());
  EXPECT_EQ(a->now().completed_steps, 3u);
}

TEST_F(DeviceLoopTest, ARequestInTheMiddleOfTheTurnsCanLeave) {
  const auto a = Cloth();
  Admit(Work("first", {a}, 3));
  StepWork second = Work("second", {a}, 3);
  CancelToken token = second.cancel;
  Admit(std::move(second));
  Admit(Work("third", {a}, 3));
  token.Cancel();
  RunAll();
  EXPECT_EQ(ended_, (std::vector<std::string>{"second", "first", "third"}));
  EXPECT_EQ(a->now().completed_steps, 6u);
}

TEST_F(DeviceLoopTest, DeletingAClothEndsWhatNamesItAndNothingElse) {
  const auto a = Cloth(), b = Cloth();
  Admit(Work("both", {a, b}, 10));
  Admit(Work("waits", {a}, 10));
  Admit(Work("other", {b}, 2));
  loop_->RunRound();
  a->End({StatusCode::kNotFound, "CLOTH_NOT_FOUND", "deleted"});
  backend_.Destroy(a->handle());
  RunAll();
  EXPECT_EQ(outcomes_["both"].status.reason(), "CLOTH_NOT_FOUND");
  EXPECT_EQ(outcomes_["waits"].status.reason(), "CLOTH_NOT_FOUND");
  EXPECT_TRUE(outcomes_["other"].status.ok());
  EXPECT_EQ(b->now().completed_steps, 3u);
  Admit(Work("too late", {a}));
  RunAll();
  EXPECT_EQ(outcomes_["too late"].status.code(), StatusCode::kNotFound);
}

TEST_F(DeviceLoopTest, MoreClothsThanABatchHoldsAreSteppedInSeveral) {
  Restart(4);
  std::vector<std::shared_ptr<ClothRuntime>> cloths;
  for (int k = 0; k < 10; ++k) cloths.push_back(Cloth());
  Admit(Work("work", cloths, 3));
  RunAll();
  EXPECT_EQ(device_->batches().size(), 8u);  // 30 cloth steps by 4
  for (const auto& cloth : cloths) EXPECT_EQ(cloth->now().completed_steps, 3u);
}

TEST_F(DeviceLoopTest, ASmallSessionIsNotHeldUpByALargeOne) {
  Restart(4);
  std::vector<std::shared_ptr<ClothRuntime>> many;
  for (int k = 0; k < 100; ++k) many.push_back(Cloth());
  Admit(Work("large", many, 50));
  Admit(Work("small", {Cloth()}, 10));
  for (int round = 0; round < 10; ++round) loop_->RunRound();
  EXPECT_EQ(ended_, std::vector<std::string>{"small"});  // in every batch
}

TEST_F(DeviceLoopTest, TimingCountsEveryBatchAndTheWaitBeforeIt) {
  const auto a = Cloth();
  device_->OnStep([this] { clock_.AdvanceUs(1000); });
  Admit(Work("first", {a}, 2));
  Admit(Work("second", {a}, 3));
  clock_.AdvanceUs(50);
  RunAll();
  EXPECT_EQ(outcomes_["first"].timing.queue_us, 50);
  EXPECT_EQ(outcomes_["second"].timing.queue_us, 2050);
  EXPECT_EQ(outcomes_["second"].timing.upload_us, 3);
  EXPECT_EQ(outcomes_["second"].timing.device_us, 30);
  EXPECT_EQ(outcomes_["second"].timing.readback_us, 300);
  EXPECT_EQ(outcomes_["first"].device_done_us, 2050);
  EXPECT_EQ(outcomes_["second"].device_done_us, 5050);
}

TEST_F(DeviceLoopTest, EndAllEndsEverything) {
  const auto a = Cloth();
  Admit(Work("first", {a}, 9));
  Admit(Work("second", {a}, 9));
  loop_->RunRound();
  loop_->EndAll({StatusCode::kUnavailable, "DRAINING", "stop"});
  EXPECT_FALSE(loop_->has_requests());
  EXPECT_EQ(outcomes_["first"].status.reason(), "DRAINING");
  EXPECT_EQ(outcomes_["second"].status.reason(), "DRAINING");
}

}  // namespace
}  // namespace drape
