// Cloths at rest in the device loop.
#include <gtest/gtest.h>

#include "tests/scheduler/device_loop_fixture.h"
#include "tests/support/plain_settings.h"

namespace drape {
namespace {

using Eigen::Vector3d;

// All of it pinned: at rest until a pin is moved.
class SleepTest : public DeviceLoopTest {
 protected:
  std::shared_ptr<ClothRuntime> SleepyCloth() {
    const auto cloth = Cloth({0, 1});
    StepSettings settings = test::PlainSettings();
    settings.time_step_s = 0.25;
    settings.sleep_motion_m = 1e-5;
    cloth->SetSettings(settings);
    return cloth;
  }

  // Steps computed since the last call.
  size_t StepsComputed() {
    size_t items = 0;
    for (const FakeBatch& batch : device_->batches()) items += batch.size();
    return items - std::exchange(computed_, items);
  }

  void MovePin(const std::shared_ptr<ClothRuntime>& cloth, const Vector3d& target_m) {
    StepWork work = Work("pin", {cloth});
    work.controls.pins = {{0, {1, target_m, 0}}};
    Admit(std::move(work));
    RunAll();
    ASSERT_TRUE(outcomes_.at("pin").status.ok());
  }

  static constexpr uint32_t kStepsToSleep = 8 + 60;
  size_t computed_ = 0;
};

// From its second piece on a long step is told its targets again; nothing has moved by that.
TEST_F(SleepTest, AStepInPiecesDoesNotWake) {
  const auto cloth = SleepyCloth();
  TakeFor({cloth}, 1'000'000);
  device_->StepInPieces(3);
  Admit(Work("x", {cloth}, kStepsToSleep));
  RunAll();
  EXPECT_GT(device_->pieces(), 2 * kStepsToSleep);
  EXPECT_TRUE(cloth->sleep().is_asleep());
}

TEST_F(SleepTest, StepsOfAClothAtRestAreNotComputed) {
  const auto cloth = SleepyCloth();
  Admit(Work("x", {cloth}, kStepsToSleep));
  RunAll();
  EXPECT_EQ(StepsComputed(), kStepsToSleep);
  EXPECT_TRUE(cloth->sleep().is_asleep());
  const uint64_t version = cloth->state_version();

  StepWork work = Work("y", {cloth}, 100);
  work.report = true;
  work.view = {true, false};
  Admit(std::move(work));
  RunAll();
  EXPECT_EQ(StepsComputed(), 0u);
  EXPECT_EQ(cloth->state_version(), version) << "nothing to send again";
  EXPECT_EQ(counters_.cloth_steps_asleep, 100u);
  EXPECT_EQ(counters_.cloth_steps, kStepsToSleep + 100u);
  const StepOutcome& outcome = outcomes_.at("y");
  EXPECT_EQ(outcome.cloths[0].stamp.completed_steps, kStepsToSleep + 100u);
  EXPECT_EQ(outcome.cloths[0].stamp.time_s, 0.25 * (kStepsToSleep + 100));
  ASSERT_TRUE(outcome.cloths[0].report.has_value());
  EXPECT_TRUE(outcome.cloths[0].report->is_asleep);
  EXPECT_EQ(outcome.cloths[0].report->measured.kinetic_energy_j, kStepsToSleep) << "measured";
  EXPECT_EQ(outcome.cloths[0].warnings.not_converged, kStepsToSleep + 100u) << "as if awake";
  EXPECT_EQ(std::get<std::vector<double>>(outcome.states->positions_m).size(), 6u);
}

TEST_F(SleepTest, NeighboursGoOn) {
  const auto sleepy = SleepyCloth(), moving = Cloth();
  Admit(Work("x", {sleepy, moving}, kStepsToSleep + 10));
  RunAll();
  EXPECT_EQ(StepsComputed(), 2 * kStepsToSleep + 10u);
  EXPECT_EQ(moving->now().completed_steps, sleepy->now().completed_steps);
}

TEST_F(SleepTest, APinThatMovesWakes) {
  const auto cloth = SleepyCloth();
  Admit(Work("x", {cloth}, kStepsToSleep));
  RunAll();
  StepsComputed();
  MovePin(cloth, {1, 0, 0});  // where it is
  EXPECT_EQ(StepsComputed(), 0u);
  MovePin(cloth, {1, 0, 0.5});
  EXPECT_EQ(StepsComputed(), 1u);
  EXPECT_FALSE(cloth->sleep().is_asleep());
  EXPECT_EQ(backend_.StateOf(cloth->handle()).positions_m[1], Vector3d(1, 0, 0.5));
}

// Every motion of a collider is in StepItem::collider_motions.
TEST_F(SleepTest, AColliderThatMovesWakes) {
  const auto cloth = SleepyCloth();
  ClothUpdate update;
  update.collider_motions = {RigidMotion::AtRest({5, 5, 5})};
  ASSERT_TRUE(backend_.Write(cloth->handle(), update).ok());
  cloth->controls().StartColliders(*update.collider_motions, {}, cloth->now().time_s);
  Admit(Work("x", {cloth}, kStepsToSleep + 1));
  RunAll();
  EXPECT_EQ(StepsComputed(), kStepsToSleep);
  StepWork work = Work("y", {cloth}, 3);
  work.controls.colliders = {{0, {0, {{5, 6, 5}}, 0}}};
  Admit(std::move(work));
  RunAll();
  EXPECT_EQ(StepsComputed(), 3u);
}

TEST_F(SleepTest, ResetAndNewSettingsWake) {
  for (const bool is_reset : {true, false}) {
    const auto cloth = SleepyCloth();
    Admit(Work("x", {cloth}, kStepsToSleep));
    RunAll();
    StepsComputed();
    StepSettings settings = test::PlainSettings();
    settings.sleep_motion_m = 1e-5;
    if (is_reset) {
      cloth->Reset({{0, 0, 0}, {1, 0, 0}}, {{0, 0, 0}, {1, 0, 0}});
    } else {
      cloth->SetSettings(settings);
    }
    Admit(Work("y", {cloth}, 1));
    RunAll();
    EXPECT_EQ(StepsComputed(), 1u);
  }
}

}  // namespace
}  // namespace drape
