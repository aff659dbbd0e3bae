// Cloths that touch each other in the device loop.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/scheduler/device_loop_fixture.h"
#include "tests/support/plain_settings.h"

namespace drape {
namespace {

using Eigen::Vector3d;
using Cloths = std::vector<std::shared_ptr<ClothRuntime>>;

class WorldsTest : public DeviceLoopTest {
 protected:
  // A cloth that has joined the world, under its number among all of them, from 1.
  std::shared_ptr<ClothRuntime> Member(const std::shared_ptr<ClothWorld>& world) {
    const auto cloth = Cloth({0, 1});
    StepSettings settings = test::PlainSettings();
    settings.time_step_s = 0.25;
    settings.sleep_motion_m = 1e-5;
    cloth->SetSettings(settings);
    cloth->Join(world, ++members_, Vector3d::Zero());
    return cloth;
  }
  Cloths Members(const std::shared_ptr<ClothWorld>& world, size_t count) {
    Cloths cloths;
    for (size_t k = 0; k < count; ++k) cloths.push_back(Member(world));
    return cloths;
  }
  const Status& StatusOf(const std::string& name) { return outcomes_.at(name).status; }
  std::vector<ClothHandle> StepOf(size_t batch) {
    std::vector<ClothHandle> handles;
    const FakeBatch items = device_->batches().at(batch);
    for (const FakeItem& item : items) handles.push_back(item.cloth);
    return handles;
  }
  void End(const std::shared_ptr<ClothRuntime>& cloth) {
    cloth->End({StatusCode::kNotFound, "CLOTH_NOT_FOUND", "deleted"});
    backend_.Destroy(cloth->handle());
  }

  std::shared_ptr<ClothWorld> world_ = std::make_shared<ClothWorld>(1);
  uint64_t members_ = 0;
};

TEST_F(WorldsTest, ARequestThatLacksAMemberMovesNothingAndNamesIt) {
  const Cloths cloths = Members(world_, 3);
  const auto other = Cloth();
  Admit(Work("x", {other, cloths[2], cloths[0]}));
  RunAll();
  EXPECT_EQ(StatusOf("x").reason(), "WORLD_INCOMPLETE");
  EXPECT_NE(StatusOf("x").message().find(" 2"), std::string::npos) << StatusOf("x").message();
  EXPECT_TRUE(device_->batches().empty());
}

// Many that end at once cost their world one pass, not one each.
TEST_F(WorldsTest, ThoseThatEndTogetherLeaveTogether) {
  const Cloths cloths = Members(world_, 5);
  cloths[1]->BeginLeaving();
  cloths[3]->BeginLeaving();
  End(cloths[3]);
  ASSERT_EQ(world_->members().size(), 3u);
  EXPECT_EQ(cloths[1]->world(), nullptr);
  EXPECT_TRUE(cloths[1]->is_alive());
  End(cloths[1]);
  Admit(Work("x", {cloths[4], cloths[2], cloths[0]}));
  RunAll();
  EXPECT_TRUE(StatusOf("x").ok());
  EXPECT_EQ(StepOf(0), (std::vector<ClothHandle>{cloths[0]->handle(), cloths[2]->handle(),
                                                 cloths[4]->handle()}));
}

// However few cloths a batch has, in the order in which they joined, beside single cloths.
TEST_F(WorldsTest, AWorldIsSteppedInOneBatchInItsOrder) {
  Restart(1);
  const Cloths a = Members(world_, 3), b = Members(std::make_shared<ClothWorld>(2), 2);
  const auto lone = Cloth();
  Admit(Work("x", {b[1], a[2], lone, a[0], b[0], a[1]}, 4));
  RunAll();
  ASSERT_TRUE(StatusOf("x").ok());
  std::vector<size_t> sizes;
  for (size_t batch = 0; batch < device_->batches().size(); ++batch) {
    const std::vector<ClothHandle> step = StepOf(batch);
    sizes.push_back(step.size());
    if (step.size() == 3) {
      EXPECT_EQ(step, (std::vector<ClothHandle>{a[0]->handle(), a[1]->handle(), a[2]->handle()}));
    } else if (step.size() == 2) {
      EXPECT_EQ(step, (std::vector<ClothHandle>{b[0]->handle(), b[1]->handle()}));
    }
    const FakeBatch items = device_->batches()[batch];
    for (const FakeItem& item : items) {
      EXPECT_EQ(item.world, step.size() == 3 ? 1u : step.size() == 2 ? 2u : 0u);
    }
  }
  for (const size_t size : {1, 2, 3}) EXPECT_EQ(std::ranges::count(sizes, size), 4) << size;
  for (const auto& outcome : outcomes_["x"].cloths) EXPECT_EQ(outcome.stamp.completed_steps, 4u);
}

TEST_F(WorldsTest, WhoJoinsEndsTheRequestsThatDoNotNameIt) {
  Cloths cloths = Members(world_, 2);
  Admit(Work("x", cloths, 10));
  for (int round = 0; round < 3; ++round) loop_->RunRound();
  cloths.push_back(Member(world_));
  RunAll();
  EXPECT_EQ(StatusOf("x").reason(), "WORLD_INCOMPLETE");
  EXPECT_EQ(cloths[0]->now().completed_steps, 3u) << "complete steps stay";
  Admit(Work("y", cloths, 2));
  RunAll();
  EXPECT_TRUE(StatusOf("y").ok());
}

TEST_F(WorldsTest, WhoLeavesIsNotMissed) {
  Cloths cloths = Members(world_, 3);
  Admit(Work("x", cloths, 10));
  for (int round = 0; round < 3; ++round) loop_->RunRound();
  End(cloths[1]);
  RunAll();
  EXPECT_EQ(StatusOf("x").reason(), "CLOTH_NOT_FOUND");
  Admit(Work("y", {cloths[0], cloths[2]}, 2));
  RunAll();
  EXPECT_TRUE(StatusOf("y").ok());
  EXPECT_EQ(cloths[2]->now().completed_steps, 5u);
}

TEST_F(WorldsTest, AWorldThatIsFaultedInPartIsNotStepped) {
  const Cloths cloths = Members(world_, 2);
  for (const auto& cloth : cloths) device_->FaultNextStep(cloth->handle());
  Admit(Work("x", cloths, 3));
  RunAll();
  ASSERT_TRUE(StatusOf("x").ok());
  ASSERT_TRUE(cloths[0]->is_faulted() && cloths[1]->is_faulted());
  Admit(Work("y", cloths, 3));
  RunAll();
  EXPECT_TRUE(StatusOf("y").ok()) << "as with faulted cloths anywhere";
  EXPECT_EQ(cloths[0]->now().completed_steps, 0u);
  cloths[1]->Restate();
  Admit(Work("z", cloths));
  RunAll();
  EXPECT_EQ(StatusOf("z").reason(), "WORLD_FAULTED");
  EXPECT_NE(StatusOf("z").message().find("cloth 1 "), std::string::npos);
}

TEST_F(WorldsTest, UntilStepNeedsMembersThatAreAsFar) {
  const auto first = Member(world_);
  Admit(Work("x", {first}, 2));
  RunAll();
  const auto second = Member(world_);
  StepWork work = Work("y", {first, second});
  work.steps.reset();
  work.until_step = 5;
  Admit(std::move(work));
  RunAll();
  EXPECT_EQ(StatusOf("y").reason(), "STEP_MISMATCH");
  Admit(Work("z", {first, second}, 3));
  RunAll();
  EXPECT_EQ(first->now().completed_steps, 5u);
  EXPECT_EQ(second->now().completed_steps, 3u);
}

TEST_F(WorldsTest, AWorldSleepsAndWakesAsAWhole) {
  const Cloths cloths = Members(world_, 3);
  Admit(Work("x", cloths, 60));
  RunAll();
  // A pin that moves keeps all awake, for as long as it does.
  StepWork moved = Work("pin", cloths, 8);
  moved.controls.pins = {{1, {1, Vector3d(0, 1, 0), 2}}};
  Admit(std::move(moved));
  RunAll();
  for (const auto& cloth : cloths) EXPECT_FALSE(cloth->sleep().is_asleep());
  Admit(Work("y", cloths, 200));
  RunAll();
  for (const auto& cloth : cloths) EXPECT_TRUE(cloth->sleep().is_asleep());
  const size_t computed = device_->batches().size();
  Admit(Work("z", cloths, 50));
  RunAll();
  EXPECT_EQ(device_->batches().size(), computed) << "nothing is computed of a world asleep";
  // What rests on a cloth falls when that is gone.
  End(cloths[0]);
  EXPECT_FALSE(cloths[1]->sleep().is_asleep());
  Admit(Work("again", {cloths[1], cloths[2]}));
  RunAll();
  EXPECT_EQ(StepOf(computed).size(), 2u);
}

// One whose positions change is not asleep, and neither are those that could.
TEST_F(WorldsTest, NoMemberSleepsBesideOneThatMoves) {
  const auto still = Member(world_), falling = Cloth();
  falling->SetSettings(still->settings());
  falling->Join(world_, 9, Vector3d::Zero());
  Admit(Work("x", {still, falling}, 300));
  RunAll();
  EXPECT_FALSE(still->sleep().is_asleep());
  EXPECT_EQ(device_->batches().size(), 300u);
}

TEST_F(WorldsTest, ALongStepOfAWorldIsDoneInPieces) {
  const Cloths cloths = Members(world_, 2);
  const auto light = Cloth();
  TakeFor(cloths, 30'000);  // each alone would not be long
  Admit(Work("x", cloths));
  RunAll();
  device_->StepInPieces(20);
  ended_.clear();
  Admit(Work("x", cloths));
  Admit(Work("light", {light}, 15));
  RunAll();
  EXPECT_EQ(ended_, (std::vector<std::string>{"light", "x"}));
  EXPECT_EQ(device_->pieces(), 20u);
  for (const auto& cloth : cloths) EXPECT_EQ(cloth->now().completed_steps, 2u);
}

}  // namespace
}  // namespace drape
