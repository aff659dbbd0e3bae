#include "server/session/control_rows.h"

#include <gtest/gtest.h>

#include <ctime>

#include "tests/session/session_fixture.h"

namespace drape {
namespace {

using Eigen::Vector3d;

class PinControlsTest : public SessionFixture {
 protected:
  PinControlsTest() {
    Start();
    ClothCreation creation = Chains(2, 3, {{0, std::nullopt}, {2, std::nullopt}});
    creation.copies[1].transform.position_m = {0, 5, 0};
    cloths_ = Find(Create(creation).value().ids);
  }
  ClothList cloths_;
};

TEST_F(PinControlsTest, TargetsAreBroughtIntoTheClothsFrame) {
  const std::vector<ControlRow<PinControl>> rows{{cloths_[1]->id, {2, {1, 6, 0}, 0.5}},
                                                 {cloths_[0]->id, {0, {1, 6, 0}, 0}}};
  const auto controls = ResolveControls({.pins = rows}, cloths_).value().pins;
  ASSERT_EQ(controls.size(), 2u);
  EXPECT_EQ(controls[0].cloth_index, 1u);
  EXPECT_EQ(controls[0].control.particle, 2u);
  EXPECT_EQ(controls[0].control.target_m,
            Eigen::Vector3d(0, 1, 0));  // the cloth's origin is (1, 5, 0)
  EXPECT_EQ(controls[0].control.over_s, 0.5);
  EXPECT_EQ(controls[1].control.target_m, Eigen::Vector3d(0, 6, 0));
}

TEST_F(PinControlsTest, BadRowsAreNamed) {
  const std::vector<ControlRow<PinControl>> rows{
      {cloths_[0]->id, {0, {}, 0}}, {{99, 1}, {0, {}, 0}}, {cloths_[1]->id, {1, {}, 0}}};
  const Status status = ResolveControls({.pins = rows}, cloths_).status();
  ASSERT_EQ(status.violations().size(), 2u);
  EXPECT_EQ(status.violations()[0].field, "pin_controls.cloth_ids[1]");
  EXPECT_EQ(status.violations()[1].field, "pin_controls.particles[2]");
}

class GripControlsTest : public SessionFixture {
 protected:
  GripControlsTest() {
    Start();
    ClothCreation creation = Chains(2, 3, {{0, std::nullopt}});
    creation.copies[1].transform.position_m = {0, 5, 0};
    for (ClothCopy& copy : creation.copies) copy.parameters.max_grips = 2;
    cloths_ = Find(Create(creation).value().ids);
  }
  ClothList cloths_;
};

TEST_F(GripControlsTest, PlacesAreBroughtIntoTheClothsFrame) {
  const std::vector<ControlRow<GripControl>> rows{
      {cloths_[1]->id,
       {.slot = 1, .action = GripAction::kGrabParticle, .particle = 2, .place_m = {1, 6, 0}}}};
  const auto controls = ResolveControls({.grips = rows}, cloths_).value().grips;
  ASSERT_EQ(controls.size(), 1u);
  EXPECT_EQ(controls[0].cloth_index, 1u);
  EXPECT_EQ(controls[0].control.particle, 2u);
  EXPECT_EQ(controls[0].control.place_m, Eigen::Vector3d(0, 1, 0));
}

TEST_F(GripControlsTest, BadRowsAreNamed) {
  const ClothId id = cloths_[0]->id;
  const auto grab = GripAction::kGrabParticle;
  const std::vector<ControlRow<GripControl>> rows{{id, {.slot = 2}},
                                                  {id, {.action = grab, .particle = 0}},
                                                  {id, {.action = grab, .particle = 3}},
                                                  {id, {.action = GripAction::kRelease}},
                                                  {{99, 1}, {}}};
  const Status status = ResolveControls({.grips = rows}, cloths_).status();
  ASSERT_EQ(status.violations().size(), 4u);
  EXPECT_EQ(status.violations()[0].field, "grip_controls.slots[0]");
  EXPECT_EQ(status.violations()[1].field, "grip_controls.particles[1]") << "pinned";
  EXPECT_EQ(status.violations()[2].field, "grip_controls.particles[2]") << "none";
  EXPECT_EQ(status.violations()[3].field, "grip_controls.cloth_ids[4]");
}

// The device thread searches: many rows of large cloths must not keep it from everybody else.
TEST_F(GripControlsTest, SearchesAreBounded) {
  const auto large = Find(Create([] {
                            ClothCreation creation = Chains(1, 1 << 16);
                            creation.copies[0].parameters.max_grips = 1;
                            return creation;
                          }())
                              .value()
                              .ids);
  std::vector<ControlRow<GripControl>> rows(
      1 << 10, {large[0]->id, {.action = GripAction::kGrabNearest, .radius_m = 1}});
  EXPECT_TRUE(ResolveControls({.grips = rows}, large).ok());
  rows.push_back(rows[0]);
  const Status status = ResolveControls({.grips = rows}, large).status();
  ASSERT_EQ(status.violations().size(), 1u);
  EXPECT_EQ(status.violations()[0].field, "grip_controls.actions[1024]");
}

class ColliderControlsTest : public SessionFixture {
 protected:
  // Two chains whose own frames have their origins at (1, 0, 0) and (1, 5, 0) of their
  // environments, each with a sphere at (2, 0, 0) of it.
  ColliderControlsTest() {
    Start();
    ClothCreation creation = Chains(2, 3);
    creation.copies[1].transform.position_m = {0, 5, 0};
    for (ClothCopy& copy : creation.copies) {
      copy.parameters.colliders = {SphereAt({2, 0, 0}, 0.5)};
    }
    cloths_ = Find(Create(creation).value().ids);
  }

  // Sends the sphere of cloth k to `position_m` of its environment, within two steps.
  void Send(size_t k, const Vector3d& position_m) {
    const std::vector<ControlRow<ColliderControl>> rows{
        {cloths_[k]->id, {0, {.position_m = position_m}, 0.5}}};
    Awaited<StepOutcome> outcome;
    StepWork work;
    work.session = session().name();
    for (const auto& cloth : cloths_) work.cloths.push_back(cloth->runtime);
    work.steps = 1;
    work.controls = ResolveControls({.colliders = rows}, cloths_).value();
    work.done = [outcome](StepOutcome o) mutable { outcome.Set(std::move(o)); };
    ASSERT_TRUE(scheduler_->Submit(std::move(work)).ok());
    ASSERT_TRUE(outcome.Get().status.ok());
  }

  // The sphere's position in the backend at the start of the last step, in the cloth frame; as
  // described if it rests.
  std::vector<RigidMotion> OnDevice(size_t k) {
    std::vector<RigidMotion> motions;
    Inspect([&](const FakeBackend& backend) {
      motions = backend.ParametersOf(cloths_[k]->runtime->handle()).collider_motions;
    });
    return motions;
  }
  Vector3d Shown(size_t k) { return DrawnColliders(*cloths_[k])[0].pose.position_m; }

  ClothList cloths_;
};

TEST_F(ColliderControlsTest, TargetsAreBroughtIntoTheClothsFrame) {
  const std::vector<ControlRow<ColliderControl>> rows{
      {cloths_[1]->id, {0, {.position_m = {1, 6, 0}}, 0.5}},
      {cloths_[0]->id, {0, {.position_m = {1, 6, 0}}, 0}}};
  const auto controls = ResolveControls({.colliders = rows}, cloths_).value().colliders;
  ASSERT_EQ(controls.size(), 2u);
  EXPECT_EQ(controls[0].cloth_index, 1u);
  EXPECT_EQ(controls[0].control.target.position_m, Vector3d(0, 1, 0));
  EXPECT_EQ(controls[0].control.over_s, 0.5);
  EXPECT_EQ(controls[1].control.target.position_m, Vector3d(0, 6, 0));
}

TEST_F(ColliderControlsTest, BadRowsAreNamed) {
  const std::vector<ControlRow<ColliderControl>> rows{
      {cloths_[0]->id, {0, {}, 0}}, {{99, 1}, {0, {}, 0}}, {cloths_[1]->id, {1, {}, 0}}};
  const Status status = ResolveControls({.colliders = rows}, cloths_).status();
  ASSERT_EQ(status.violations().size(), 2u);
  EXPECT_EQ(status.violations()[0].field, "collider_controls.cloth_ids[1]");
  EXPECT_EQ(status.violations()[1].field, "collider_controls.colliders[2]");
  EXPECT_NE(status.violations()[1].description.find("1 is not below"), std::string::npos);
}

// The device takes a cloth anew when its first collider moves.
TEST_F(ColliderControlsTest, MovedClothsAreBounded) {
  ClothCreation creation = Chains(4, 2);
  for (ClothCopy& copy : creation.copies) copy.parameters.colliders = {SphereAt({2, 0, 0}, 0.5)};
  creation.copies.resize(52'266, creation.copies[0]);  // of 2 + 512 + 128: 2^25 and one more
  const ClothList many = Find(Create(std::move(creation)).value().ids);
  std::vector<ControlRow<ColliderControl>> rows;
  for (const auto& cloth : many) rows.push_back({cloth->id, {0, {.position_m = {1, 6, 0}}, 0}});
  const Status status = ResolveControls({.colliders = rows}, many).status();
  ASSERT_FALSE(status.violations().empty());
  EXPECT_EQ(status.violations()[0].field, "collider_controls.cloth_ids[52265]");
  rows.resize(52'265);
  rows.push_back(rows[0]);  // of a cloth that is moved anyway
  EXPECT_TRUE(ResolveControls({.colliders = rows}, many).ok());
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
  colliders.colliders = {SphereAt({7, 0, 0}, 0.5)};
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

// All or nothing: writes before the failure are undone, motions included.
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

class RestLengthControlsTest : public SessionFixture {
 protected:
  RestLengthControlsTest() {
    Start();
    cloths_ = Find(Create(Chains(2, 3, {{0, std::nullopt}, {1, std::nullopt}})).value().ids);
  }
  ClothList cloths_;
};

TEST_F(RestLengthControlsTest, RowsFindTheirCloths) {
  const std::vector<ControlRow<LengthControl>> rows{{cloths_[1]->id, {1, 0.75, 0.5}}};
  const auto controls = ResolveControls({.lengths = rows}, cloths_).value().lengths;
  ASSERT_EQ(controls.size(), 1u);
  EXPECT_EQ(controls[0].cloth_index, 1u);
  EXPECT_EQ(controls[0].control.constraint, 1u);
  EXPECT_EQ(controls[0].control.length_m, 0.75);
  EXPECT_EQ(controls[0].control.over_s, 0.5);
  const std::vector<ControlRow<LengthScale>> scales{{cloths_[1]->id, {2, 0.25}}};
  EXPECT_EQ(
      ResolveControls({.length_scales = scales}, cloths_).value().length_scales[0].cloth_index, 1u);
}

TEST_F(RestLengthControlsTest, BadRowsAreNamed) {
  const std::vector<ControlRow<LengthControl>> rows{
      {cloths_[0]->id, {1, 1, 0}},
      {{99, 1}, {0, 1, 0}},
      {cloths_[0]->id, {0, 1, 0}},   // between two pins
      {cloths_[0]->id, {2, 1, 0}}};  // there are two
  const Status status = ResolveControls({.lengths = rows}, cloths_).status();
  ASSERT_EQ(status.violations().size(), 3u);
  EXPECT_EQ(status.violations()[0].field, "rest_length_controls.cloth_ids[1]");
  EXPECT_EQ(status.violations()[1].field, "rest_length_controls.constraints[2]");
  EXPECT_NE(status.violations()[1].description.find("two pins"), std::string::npos);
  EXPECT_EQ(status.violations()[2].field, "rest_length_controls.constraints[3]");

  const std::vector<ControlRow<LengthScale>> scales{
      {{99, 1}, {2, 0}}, {cloths_[0]->id, {1e-10, 0}}, {cloths_[0]->id, {2, 0}}};
  const Status scaled = ResolveControls({.length_scales = scales}, cloths_).status();
  ASSERT_EQ(scaled.violations().size(), 3u);
  EXPECT_EQ(scaled.violations()[0].field, "rest_length_scales.cloth_ids[0]");
  EXPECT_EQ(scaled.violations()[1].field, "rest_length_scales.scales[1]");
  EXPECT_EQ(scaled.violations()[2].field, "rest_length_scales.cloth_ids[2]");
  EXPECT_NE(scaled.violations()[2].description.find("occurs twice"), std::string::npos);
}

// Every two of 1025 particles, in each of 16 cloths: together a little more than one request
// drives.
TEST_F(RestLengthControlsTest, DrivenConstraintsAreBounded) {
  ClothCreation creation = Chains(16, 1025);
  ModelDescription description = *creation.description;
  auto& topology = std::get<ParticleTopology>(description.topology);
  topology.distance_constraints.clear();
  for (uint32_t a = 0; a < 1025; ++a) {
    for (uint32_t b = a + 1; b < 1025; ++b) {
      topology.distance_constraints.push_back({a, b, 1.0 * (b - a), 0});
    }
  }
  creation.description = std::make_shared<const ModelDescription>(std::move(description));
  creation.model = SceneModel::Build(*creation.description).value();
  const ClothList dense = Find(Create(std::move(creation)).value().ids);
  std::vector<ControlRow<LengthScale>> scales;
  for (const auto& cloth : dense) scales.push_back({cloth->id, {1.5, 0}});
  std::vector<ControlRow<LengthControl>> lengths;
  for (const auto& cloth : dense) lengths.push_back({cloth->id, {7, 2, 0}});
  lengths.push_back({dense[0]->id, {8, 2, 0}});  // of a cloth that is driven anyway
  const auto first = [](const auto& rows, size_t count) {
    return std::remove_cvref_t<decltype(rows)>(rows.begin(),
                                               rows.begin() + static_cast<ptrdiff_t>(count));
  };
  EXPECT_TRUE(
      ResolveControls({.lengths = first(lengths, 15), .length_scales = first(scales, 15)}, dense)
          .ok())
      << "the same cloths";
  const Status scaled = ResolveControls({.length_scales = scales}, dense).status();
  ASSERT_EQ(scaled.violations().size(), 1u);
  EXPECT_EQ(scaled.violations()[0].field, "rest_length_scales.cloth_ids[15]");
  EXPECT_NE(scaled.violations()[0].description.find("8396800 constraints, at most 8388608"),
            std::string::npos)
      << scaled.violations()[0].description;
  const Status driven = ResolveControls({.lengths = lengths}, dense).status();
  ASSERT_EQ(driven.violations().size(), 1u);
  EXPECT_EQ(driven.violations()[0].field, "rest_length_controls.cloth_ids[15]");
}

// Clients may drive every constraint of a large cloth. A search per row would be 2e10 comparisons,
// tens of seconds; this takes about as long as to make the rows.
TEST_F(RestLengthControlsTest, ManyRowsTakeTimeInProportion) {
  constexpr uint32_t kLinks = 200'000;
  const ClothList chain = Find(Create(Chains(1, kLinks + 1)).value().ids);
  std::vector<ControlRow<LengthControl>> rows;
  for (uint32_t k = 0; k < kLinks; ++k) rows.push_back({chain[0]->id, {k, 1, 0}});
  const std::clock_t begin = std::clock();
  EXPECT_EQ(ResolveControls({.lengths = rows}, chain).value().lengths.size(), kLinks);
  EXPECT_LT(std::clock() - begin, 3 * CLOCKS_PER_SEC);
}

}  // namespace
}  // namespace drape
