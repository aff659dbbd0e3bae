// Steps that take longer than a batch may, in pieces.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/scheduler/device_loop_fixture.h"

namespace drape {
namespace {

using Eigen::Vector3d;

using LongStepsTest = DeviceLoopTest;

// One step takes a second: the others have a step between any two of its pieces.
TEST_F(LongStepsTest, OthersAreSteppedBetweenThePiecesOfALongStep) {
  const auto heavy = Cloth(), light = Cloth();
  TakeFor({heavy}, 1'000'000);
  Admit(Work("heavy", {heavy}));
  RunAll();
  device_->StepInPieces(20);
  Admit(Work("heavy", {heavy}));
  Admit(Work("light", {light}, 15));
  ended_.clear();
  RunAll();
  EXPECT_EQ(ended_, (std::vector<std::string>{"light", "heavy"}));
  EXPECT_EQ(device_->pieces(), 20u);
  EXPECT_EQ(heavy->now().completed_steps, 2u);
  EXPECT_EQ(outcomes_["heavy"].cloths[0].stamp.completed_steps, 2u);
}

// Nobody expected the step to take long: it is left undone, and then done in pieces.
TEST_F(LongStepsTest, AStepThatTakesTooLongIsDoneInPieces) {
  const auto heavy = Cloth({0}), light = Cloth();
  device_->LeaveUndone({heavy->handle()}, 1);
  device_->StepInPieces(5);
  StepWork work = Work("heavy", {heavy}, 2);
  work.controls.pins.push_back({0, {.particle = 0, .target_m = Vector3d(7, 0, 0)}});
  Admit(std::move(work));
  Admit(Work("light", {light}, 4));
  loop_->RunRound();
  EXPECT_EQ(light->now().completed_steps, 1u);
  EXPECT_EQ(heavy->now().completed_steps, 0u);
  EXPECT_EQ(device_->batches().back().size(), 1u);
  RunAll();
  EXPECT_EQ(ended_, (std::vector<std::string>{"light", "heavy"}));
  EXPECT_GE(device_->pieces(), 5u);
  EXPECT_EQ(heavy->now().completed_steps, 2u);
  EXPECT_EQ(outcomes_["heavy"].cloths[0].stamp.completed_steps, 2u);
  EXPECT_EQ(outcomes_["light"].cloths[0].stamp.completed_steps, 4u);
  // What the step that was left undone had been told is told again.
  size_t moved = 0;
  for (const FakeBatch& batch : device_->batches()) {
    for (const auto& item : batch) moved += item.pin_targets_m == std::vector<Vector3d>{{7, 0, 0}};
  }
  EXPECT_GE(moved, 1u);
}

// What a batch left before it had begun is no longer for that: its turn comes again.
TEST_F(LongStepsTest, ManyMayBeLeftUndone) {
  const auto a = Cloth(), b = Cloth(), c = Cloth(), d = Cloth();
  device_->LeaveUndone({a->handle(), c->handle(), d->handle()}, 2);
  Admit(Work("x", {a, b}, 3));
  Admit(Work("y", {c}, 3));
  Admit(Work("y", {d}, 3));
  RunAll();
  for (const auto& cloth : {a, b, c, d}) EXPECT_EQ(cloth->now().completed_steps, 3u);
  EXPECT_EQ(outcomes_["x"].cloths[1].stamp.completed_steps, 3u);
}

TEST_F(LongStepsTest, CancellingStopsALongStepAtTheNextPiece) {
  const auto heavy = Cloth({0});
  TakeFor({heavy}, 1'000'000);
  Admit(Work("heavy", {heavy}));
  RunAll();
  device_->StepInPieces(1000);
  StepWork work = Work("heavy", {heavy}, 5);
  CancelToken token = work.cancel;
  work.controls.pins.push_back({0, {.particle = 0, .target_m = Vector3d(7, 0, 0)}});
  Admit(std::move(work));
  for (int round = 0; round < 3; ++round) loop_->RunRound();
  token.Cancel();
  loop_->RunRound();
  EXPECT_FALSE(loop_->has_requests());
  EXPECT_EQ(outcomes_["heavy"].status.code(), StatusCode::kCancelled);
  EXPECT_EQ(heavy->now().completed_steps, 1u);
  EXPECT_EQ(device_->abandoned(), 1u);
  // The pin goes on: what the dropped step was told is told again.
  device_->StepInPieces(1);
  Admit(Work("heavy", {heavy}));
  RunAll();
  EXPECT_EQ(heavy->now().completed_steps, 2u);
  EXPECT_EQ(device_->batches().back()[0].pin_targets_m, (std::vector<Vector3d>{{7, 0, 0}}));
}

TEST_F(LongStepsTest, ASessionHasOneLongStepUnderWay) {
  const auto a = Cloth(), b = Cloth(), c = Cloth();
  TakeFor({a, b, c}, 1'000'000);
  Admit(Work("x", {a, b}));
  Admit(Work("y", {c}));
  RunAll();
  device_->StepInPieces(10);
  Admit(Work("x", {a}));
  Admit(Work("x", {b}));
  Admit(Work("y", {c}));
  size_t most = 0;
  while (loop_->has_requests()) {
    loop_->RunRound();
    most = std::max(most, device_->under_way());
  }
  EXPECT_EQ(most, 2u);
  for (const auto& cloth : {a, b, c}) EXPECT_EQ(cloth->now().completed_steps, 2u);
}

// There is room for the steps of two cloths.
class RoomOfLongSteps : public DeviceLoopTest {
 protected:
  using Cloths = std::vector<std::shared_ptr<ClothRuntime>>;

  RoomOfLongSteps() { Restart(16384, 50'000, 2); }

  // A world.
  Cloths BeginHeap(size_t count) {
    Cloths heap;
    for (size_t k = 0; k < count; ++k) {
      heap.push_back(Cloth());
      heap.back()->Join(world_, k, Vector3d::Zero());
    }
    return heap;
  }
  // After a step of each of them. The next ones take ten pieces.
  void KnowToBeLong(const Cloths& cloths, const Cloths& heap) {
    Cloths all = cloths;
    all.insert(all.end(), heap.begin(), heap.end());
    TakeFor(all, 1'000'000);
    Admit(Work("x", cloths));
    Admit(Work("y", heap));
    RunAll();
    device_->StepInPieces(10);
  }

  const std::shared_ptr<ClothWorld> world_ = std::make_shared<ClothWorld>(1);
};

// A world has the working memory of all of its cloths. What waits for that is not overtaken.
TEST_F(RoomOfLongSteps, WorkingMemoryHasALimitThatOneMayExceed) {
  const auto heap = BeginHeap(3);
  const auto a = Cloth(), b = Cloth(), c = Cloth(), d = Cloth();
  KnowToBeLong({a, b, c, d}, heap);
  Admit(Work("a", {a}));
  Admit(Work("b", {b}));
  Admit(Work("heap", heap));
  Admit(Work("c", {c}));
  Admit(Work("d", {d}));
  std::map<size_t, int> rounds;  // with so many under way
  std::vector<std::string> order;
  while (loop_->has_requests()) {
    loop_->RunRound();
    ++rounds[device_->under_way()];
    for (const auto& [name, outcome] : outcomes_) {
      if (std::ranges::count(order, name) == 0) order.push_back(name);
    }
  }
  EXPECT_EQ(rounds.rbegin()->first, 2u);
  EXPECT_GT(rounds[2], 20);
  EXPECT_GE(rounds[1], 10) << "the heap, beside nothing";
  ASSERT_EQ(order.size(), 7u);
  EXPECT_EQ(order[4], "heap");
}

// Those that are under way take room again with each of their steps, but not before who waits.
TEST_F(RoomOfLongSteps, WhoLacksRoomIsNotOvertakenByTheNextStepsOfOthers) {
  const auto heap = BeginHeap(2);
  const auto a = Cloth(), b = Cloth();
  KnowToBeLong({a, b}, heap);
  Admit(Work("a", {a}, 50));
  Admit(Work("b", {b}, 50));
  loop_->RunRound();
  Admit(Work("heap", heap));
  while (!outcomes_.contains("heap")) loop_->RunRound();
  EXPECT_LE(a->now().completed_steps, 4u);
  EXPECT_LE(b->now().completed_steps, 4u);
  EXPECT_FALSE(outcomes_.contains("a"));
  RunAll();
}

// What cannot run now, for its tenant has used up its rate, is not waited for.
TEST_F(RoomOfLongSteps, WhoIsHeldBackKeepsNobodyFromRoom) {
  const auto heap = BeginHeap(2);
  const auto a = Cloth(), b = Cloth();
  KnowToBeLong({a, b}, heap);
  Admit(Work("a", {a}, 20));
  loop_->RunRound();
  StepWork held = Work("heap", heap, 2);
  held.tenant = "limited";
  Admit(std::move(held));
  loop_->RunRound();  // it waits for room
  rates_.Set({.per_tenant = 1e9});
  rates_.Charge("limited", 1e15);
  Admit(Work("b", {b}));
  while (!outcomes_.contains("b")) loop_->RunRound();
  EXPECT_FALSE(outcomes_.contains("a"));
  EXPECT_FALSE(outcomes_.contains("heap"));
}

// By its solves it costs nothing. What its report has to find may take long all the same.
TEST_F(LongStepsTest, TheReportOfAFaultedClothIsFoundInPiecesIfItTakesLong) {
  const auto cloth = Cloth();
  device_->FaultNextStep(cloth->handle());
  Admit(Work("x", {cloth}));
  RunAll();
  ASSERT_TRUE(cloth->is_faulted());
  device_->LeaveUndone({cloth->handle()}, 1'000'000);
  device_->StepInPieces(3);
  StepWork work = Work("x", {cloth});
  work.report = true;
  Admit(std::move(work));
  for (int round = 0; round < 10 && loop_->has_requests(); ++round) loop_->RunRound();
  EXPECT_FALSE(loop_->has_requests());
  EXPECT_EQ(device_->pieces(), 3u);
}

TEST_F(LongStepsTest, DeletingAClothDropsItsLongStep) {
  const auto heavy = Cloth();
  TakeFor({heavy}, 1'000'000);
  Admit(Work("heavy", {heavy}));
  RunAll();
  device_->StepInPieces(10);
  Admit(Work("heavy", {heavy}));
  loop_->RunRound();
  heavy->End({StatusCode::kNotFound, "CLOTH_NOT_FOUND", ""});
  backend_.Destroy(heavy->handle());
  RunAll();
  EXPECT_EQ(outcomes_["heavy"].status.code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace drape
