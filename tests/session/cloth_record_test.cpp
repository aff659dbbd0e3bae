#include "server/session/cloth_record.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/scheduler/fake_backend.h"
#include "tests/support/plain_settings.h"

namespace drape {
namespace {

using Eigen::Vector3d;

RigidTransform QuarterTurnAboutY(const Vector3d& position_m) {
  return {position_m,
          Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitY()))};
}

TEST(ClothRecord, TheOriginIsTheCentroidInSinglePrecision) {
  const auto model = ChainModel(3);  // centroid (1, 0, 0)
  RigidTransform transform;
  transform.position_m = {0.1, 7, -1000};
  const Vector3d origin = OriginInEnvironment(*model, transform);
  EXPECT_EQ(origin, Vector3d(static_cast<float>(1.1), 7, -1000));
  EXPECT_NE(origin.x(), 1.1);
}

TEST(ClothRecord, TheRestShapeIsTurnedThenMovedThenSeenFromTheOrigin) {
  const auto model = ChainModel(3);
  const RigidTransform transform = QuarterTurnAboutY({4, 5, 6});
  const Placement placement{Vector3d::Zero(), OriginInEnvironment(*model, transform)};
  const ParticleState state = PlaceAtStart(*model, transform, placement);
  // +x turned by a quarter about +y is -z. The origin is off by float rounding of about 1e-7.
  for (int p = 0; p < 3; ++p) {
    EXPECT_LT((state.positions_m[static_cast<size_t>(p)] - Vector3d(0, 0, 1 - p)).norm(), 1e-6);
    EXPECT_EQ(state.velocities_m_per_s[static_cast<size_t>(p)], Vector3d::Zero());
  }
}

TEST(ClothRecord, CopiesThatDifferOnlyByTheirEnvironmentHaveTheSameBits) {
  const auto model = ChainModel(7);
  const RigidTransform transform = QuarterTurnAboutY({0.3, 0.7, 0.1});
  const Vector3d origin = OriginInEnvironment(*model, transform);
  const auto here = PlaceAtStart(*model, transform, {Vector3d::Zero(), origin});
  const auto there = PlaceAtStart(*model, transform, {Vector3d(1e5, 0.1, 3), origin});
  EXPECT_EQ(here.positions_m, there.positions_m);
}

TEST(ClothRecord, CollidersMoveIntoTheClothFrame) {
  ClothParameters parameters = test::PlainParameters();
  parameters.thickness_m = 0.25;
  parameters.colliders = {SphereAt({1, 2, 3}, 0.5), PlaneThrough({0, -1, 0}, {0, 1, 0}),
                          CapsuleBetween({1, 2, 3}, {4, 5, 6}, 0.5),
                          BoxAt({1, 2, 3}, {4, 5, 6}, Eigen::Quaterniond(0, 1, 0, 0))};
  const auto shifted = InClothFrame(parameters, {Vector3d(9, 9, 9), Vector3d(1, 1, 1)});
  EXPECT_EQ(shifted.colliders[0], SphereAt({0, 1, 2}, 0.5));
  EXPECT_EQ(shifted.colliders[1], PlaneThrough({-1, -2, -1}, {0, 1, 0}));
  const ColliderNumbers capsule = NumbersOf(shifted.colliders[2]);
  EXPECT_EQ(capsule.point_m, Vector3d(0, 1, 2));
  EXPECT_EQ(capsule.vector, Vector3d(3, 3, 3));
  EXPECT_EQ(capsule.radius_m, 0.5);
  EXPECT_EQ(shifted.colliders[3], BoxAt({0, 1, 2}, {4, 5, 6}, Eigen::Quaterniond(0, 1, 0, 0)));
  EXPECT_EQ(shifted.thickness_m, 0.25);
}

TEST(ClothRecord, ReportsAreBroughtToWorldAndEnvironment) {
  ClothParameters parameters = test::PlainParameters();
  parameters.gravity_m_per_s2 = {0, -10, 0};
  const auto shift = ShiftOf(*ChainModel(3), parameters, {Vector3d(0, 100, 0), Vector3d(1, 2, 3)});
  EXPECT_EQ(shift.lowest_m, 102);
  EXPECT_EQ(shift.potential_energy_j, 3 * 10 * 2);  // m g h of the origin in its environment
}

TEST(ClothRecord, PinsWithoutATargetStayWhereTheyStart) {
  const std::vector<Pin> pins{{0, std::nullopt}, {2, Vector3d(5, 5, 5)}};
  const auto targets = PinTargets(pins, {Vector3d::Zero(), Vector3d(1, 0, 0)},
                                  {Vector3d(-1, 0, 0), Vector3d(1, 0, 0)});
  EXPECT_EQ(targets, (std::vector<Vector3d>{{-1, 0, 0}, {4, 5, 5}}));
}

TEST(ClothRecord, AChangeTouchesOnlyWhatItNames) {
  ClothParameters current = test::PlainParameters();
  current.friction_static = 0.5;
  current.damping_per_s = 3;
  current.air_drag = 1.2;
  ClothChange change;
  change.gravity_m_per_s2 = Vector3d(1, 2, 3);
  change.settings = PresetSettings(Preset::kPaper);
  change.wind_m_per_s = Vector3d(0, 0, 4);
  change.numbers.Set(&ClothParameters::air_lift, 0.5);
  const ClothParameters changed = ApplyChange(current, change).value();
  EXPECT_EQ(changed.gravity_m_per_s2, Vector3d(1, 2, 3));
  EXPECT_EQ(changed.settings, PresetSettings(Preset::kPaper));
  EXPECT_EQ(changed.friction_static, 0.5);
  EXPECT_EQ(changed.damping_per_s, 3);
  EXPECT_EQ(changed.wind_m_per_s, Vector3d(0, 0, 4));
  EXPECT_EQ(changed.air_drag, 1.2);
  EXPECT_EQ(changed.air_lift, 0.5);
}

TEST(ClothRecord, AChangeThatBreaksTheOrderOfFrictionIsRefused) {
  ClothParameters current = test::PlainParameters();
  current.friction_static = 0.5;
  current.friction_dynamic = 0.4;
  ClothChange change;
  change.numbers.Set(&ClothParameters::friction_static, 0.3);
  EXPECT_EQ(ApplyChange(current, change).status().violations()[0].field,
            "spec.material.friction_static");
  change = {};
  change.numbers.Set(&ClothParameters::friction_dynamic, 0.6);
  EXPECT_EQ(ApplyChange(current, change).status().violations()[0].field,
            "spec.material.friction_dynamic");
}

}  // namespace
}  // namespace drape
