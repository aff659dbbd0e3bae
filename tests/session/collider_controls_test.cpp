#include "server/session/collider_controls.h"

#include <gtest/gtest.h>

#include "tests/session/session_fixture.h"

namespace drape {
namespace {

using Eigen::Vector3d;

class ColliderControlsTest : public SessionFixture {
 protected:
  // Two chains whose own frames lie at (1, 0, 0) and (1, 5, 0) of their environments, each with a
  // sphere at (2, 0, 0) of it.
  ColliderControlsTest() {
    Start();
    ClothCreation creation = Chains(2, 3);
    creation.copies[1].transform.position_m = {0, 5, 0};
    for (ClothCopy& copy : creation.copies) {
      copy.parameters.colliders = {SphereCollider{{2, 0, 0}, 0.5}};
    }
    cloths_ = Find(Create(creation).value().ids);
  }

  // Sends the sphere of cloth k to `position_m` of its environment, within two steps.
  void Send(size_t k, const Vector3d& position_m) {
    const std::vector<ColliderControlRow> rows{
        {cloths_[k]->id, 0, {.position_m = position_m}, 0.5}};
    Awaited<StepOutcome> outcome;
    StepWork work;
    work.tenant = session().name();
    for (const auto& cloth : cloths_) work.cloths.push_back(cloth->runtime);
    work.steps = 1;
    work.collider_controls = MapColliderControls(rows, cloths_).value();
    work.done = [outcome](StepOutcome o) mutable { outcome.Set(std::move(o)); };
    ASSERT_TRUE(scheduler_->Submit(std::move(work)).ok());
    ASSERT_TRUE(outcome.Get().status.ok());
  }

  // Where the backend has the sphere at the start of the last step, in the cloth frame; as
  // described if it rests.
  std::vector<RigidMotion> OnDevice(size_t k) {
    std::vector<RigidMotion> motions;
    Inspect([&](const FakeBackend& backend) {
      motions = backend.ParametersOf(cloths_[k]->runtime->handle()).collider_motions;
    });
    return motions;
  }
  Vector3d Shown(size_t k) {
    return std::get<SphereCollider>(CollidersNow(*cloths_[k])[0]).center_m;
  }

  ClothList cloths_;
};

TEST_F(ColliderControlsTest, TargetsAreBroughtIntoTheClothsFrame) {
  const std::vector<ColliderControlRow> rows{{cloths_[1]->id, 0, {.position_m = {1, 6, 0}}, 0.5},
                                             {cloths_[0]->id, 0, {.position_m = {1, 6, 0}}, 0}};
  const auto controls = MapColliderControls(rows, cloths_).value();
  ASSERT_EQ(controls.size(), 2u);
  EXPECT_EQ(controls[0].cloth_index, 1u);
  EXPECT_EQ(controls[0].target.position_m, Vector3d(0, 1, 0));
  EXPECT_EQ(controls[0].over_s, 0.5);
  EXPECT_EQ(controls[1].target.position_m, Vector3d(0, 6, 0));
}

TEST_F(ColliderControlsTest, BadRowsAreNamed) {
  const std::vector<ColliderControlRow> rows{
      {cloths_[0]->id, 0, {}, 0}, {{99, 1}, 0, {}, 0}, {cloths_[1]->id, 1, {}, 0}};
  const Status status = MapColliderControls(rows, cloths_).status();
  ASSERT_EQ(status.violations().size(), 2u);
  EXPECT_EQ(status.violations()[0].field, "collider_controls.cloth_ids[1]");
  EXPECT_EQ(status.violations()[1].field, "collider_controls.colliders[2]");
  EXPECT_NE(status.violations()[1].description.find("1 is not below"), std::string::npos);
}

TEST_F(ColliderControlsTest, OneClothsColliderMovesAndIsBroughtBackByReset) {
  EXPECT_TRUE(OnDevice(0).empty());
  Send(1, {2, 4, 0});
  EXPECT_TRUE(OnDevice(0).empty());
  ASSERT_EQ(OnDevice(1).size(), 1u);
  EXPECT_EQ(OnDevice(1)[0].position_m, Vector3d(1, -5, 0));
  EXPECT_EQ(OnDevice(1)[0].velocity_m_per_s, Vector3d(0, 8, 0));
  EXPECT_EQ(Shown(1), Vector3d(2, 2, 0));
  EXPECT_EQ(Shown(0), Vector3d(2, 0, 0));
  EXPECT_TRUE(Reset({cloths_[1]}).ok());
  EXPECT_TRUE(OnDevice(1).empty());
  EXPECT_EQ(Shown(1), Vector3d(2, 0, 0));
}

TEST_F(ColliderControlsTest, MotionsGoOnThroughUpdatesButNotThoseOfColliders) {
  Send(0, {2, 4, 0});
  ClothChange gravity;
  gravity.gravity_m_per_s2 = Vector3d(0, -1, 0);
  ASSERT_TRUE(Update(cloths_, gravity).ok());
  ASSERT_EQ(OnDevice(0).size(), 1u);
  EXPECT_EQ(OnDevice(0)[0].position_m, Vector3d(1, 2, 0));
  EXPECT_TRUE(OnDevice(1).empty());
  Step(cloths_, 1);
  EXPECT_EQ(Shown(0), Vector3d(2, 4, 0));

  ClothChange colliders;
  colliders.colliders = {SphereCollider{{7, 0, 0}, 0.5}};
  ASSERT_TRUE(Update(cloths_, colliders).ok());
  EXPECT_TRUE(OnDevice(0).empty());
  EXPECT_EQ(Shown(0), Vector3d(7, 0, 0));
  RigidMotion moving = RigidMotion::AtRest(Vector3d(7, 0, 0));
  moving.velocity_m_per_s = Vector3d(1, 0, 0);
  colliders.collider_motions = {moving};
  ASSERT_TRUE(Update(cloths_, colliders).ok());
  Step(cloths_, 2);
  EXPECT_EQ(Shown(0), Vector3d(7.5, 0, 0));
  // Reset returns to the colliders as they were last described, and restarts their motion.
  EXPECT_TRUE(Reset(cloths_).ok());
  EXPECT_EQ(Shown(0), Vector3d(7, 0, 0));
  Step(cloths_, 1);
  EXPECT_EQ(Shown(0), Vector3d(7.25, 0, 0));
}

// All or nothing: what was written before the failure is taken back, motions included.
TEST_F(ColliderControlsTest, AnUpdateThatFailsLeavesTheMotions) {
  Send(0, {2, 4, 0});
  ClothChange colliders;
  colliders.colliders = std::vector<Collider>{};
  device_->FailWrite(1);
  EXPECT_FALSE(Update(cloths_, colliders).ok());
  ASSERT_EQ(OnDevice(0).size(), 1u);
  EXPECT_EQ(OnDevice(0)[0].position_m, Vector3d(1, 2, 0));
  Step(cloths_, 1);
  EXPECT_EQ(Shown(0), Vector3d(2, 4, 0));
}

}  // namespace
}  // namespace drape
