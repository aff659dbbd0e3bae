#include "server/scene/start_clearance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/scene/distance_map.h"
#include "server/scene/scene_model.h"
#include "tests/support/solids/solids.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

const Vector3d kUp = Vector3d::UnitY();

std::shared_ptr<const SceneModel> Build(const ModelDescription& description) {
  auto model = SceneModel::Build(description);
  EXPECT_TRUE(model.ok()) << model.status().ToString();
  return *model;
}

constexpr uint32_t kSide = 12;
// An inner particle of Sheet, and where it is.
constexpr uint32_t kMiddle = 5 * kSide + 5;
const Vector3d kMiddle_m(5.0 / (kSide - 1), 0, 5.0 / (kSide - 1));

// 1 m, in the xz plane at y = 0.
std::shared_ptr<const SceneModel> Sheet(std::vector<uint32_t> pins = {}) {
  return Build({GridTopology{kSide, kSide, 1, 1}, {}, std::move(pins)});
}

// Links of 0.1 m.
std::shared_ptr<const SceneModel> Pair(const DistanceConstraint& link,
                                       std::vector<uint32_t> pins = {}) {
  return Build({ParticleTopology{{{0, 0, 0}, {0.1, 0, 0}}, {1, 1}, {link}, {}}, {}, pins});
}

ClearStart Start(const SceneModel& model, const std::vector<Collider>& colliders,
                 const std::vector<Vector3d>& positions_m, const Vector3d& up = kUp,
                 double thickness_m = 0) {
  return ClearOfColliders(model.length_demands(), {colliders, thickness_m}, up, positions_m);
}

std::vector<Vector3d> Rest(const SceneModel& model) {
  return {model.rest_positions_m().begin(), model.rest_positions_m().end()};
}

// Expects particles outside all colliders and links of their lengths, both up to the errors that
// need no restoring; no caught links by the function itself; and pins in place.
void ExpectCleared(const SceneModel& model, const std::vector<Collider>& colliders,
                   const std::vector<Vector3d>& positions_m, double thickness_m = 0) {
  const ClearStart start = Start(model, colliders, positions_m, kUp, thickness_m);
  ASSERT_EQ(start.clearance, StartClearance::kCleared);
  EXPECT_LE(start.errors.max, kRestoredError);
  EXPECT_LE(FindLengthErrors(model.length_demands(), start.positions_m).max, kRestoredError);
  for (const Vector3d& p : start.positions_m) {
    for (const Collider& collider : colliders) {
      EXPECT_GE(SurfaceOf(collider, p).distance_m - thickness_m,
                -kRestoredError * model.length_scale_m());
    }
  }
  for (const uint32_t pin : model.pins()) EXPECT_EQ(start.positions_m[pin], positions_m[pin]);
  EXPECT_EQ(Start(model, colliders, start.positions_m, kUp, thickness_m).clearance,
            StartClearance::kFree);
}

TEST(StartClearance, SheetAcrossASphere) {
  const auto model = Sheet();
  for (const double aside_m : {0.0, 0.02, 0.045, 0.3}) {
    for (const double above_m : {-0.1, -0.01, 0.0, 0.02}) {
      SCOPED_TRACE(testing::Message() << aside_m << " m aside, " << above_m << " m above");
      const Vector3d centre_m = kMiddle_m + Vector3d(aside_m, above_m, 0);
      ExpectCleared(*model, {SphereAt(centre_m, 0.3)}, Rest(*model));
    }
  }
}

TEST(StartClearance, SheetAcrossOtherColliders) {
  const auto model = Sheet();
  ExpectCleared(*model, {CapsuleBetween({0.2, 0, 0.5}, {0.8, 0, 0.5}, 0.1)}, Rest(*model));
  ExpectCleared(*model, {BoxAt({0.5, 0.02, 0.5}, {0.2, 0.2, 0.2})}, Rest(*model));
  // On a floor, and two at once.
  ExpectCleared(*model, {SphereAt(kMiddle_m, 0.3), PlaneThrough({0, -0.1, 0}, kUp)}, Rest(*model));
  ExpectCleared(*model, {SphereAt({0.3, 0, 0.5}, 0.15), SphereAt({0.7, 0, 0.5}, 0.15)},
                Rest(*model));
  ExpectCleared(*model, {SphereAt(kMiddle_m, 0.28)}, Rest(*model), 0.02);
}

TEST(StartClearance, SheetAcrossAMesh) {
  const auto map = DistanceMap::Build(SphereMesh(0.3, 3), {.resolution = 32});
  ASSERT_TRUE(map.ok()) << map.status().ToString();
  Collider solid = DistanceMapAt(*map);
  solid.pose.position_m = kMiddle_m;
  std::vector<Collider> colliders;
  colliders.emplace_back(solid);
  const auto model = Sheet();
  ExpectCleared(*model, colliders, Rest(*model));
}

TEST(StartClearance, SheetHeldByACorner) {
  const auto model = Sheet({0});
  ExpectCleared(*model, {SphereAt(kMiddle_m, 0.3)}, Rest(*model));
}

// Each to its nearer side; none of the sheet stays on the other.
TEST(StartClearance, TiltedSheetsGoToOneSide) {
  const auto model = Sheet();
  for (const double angle_rad : {0.0, 0.3, 0.8, std::numbers::pi / 2}) {
    SCOPED_TRACE(angle_rad);
    const Eigen::AngleAxisd turn(angle_rad, Vector3d::UnitZ());
    std::vector<Vector3d> positions_m = Rest(*model);
    for (Vector3d& p : positions_m) p = turn * (p - kMiddle_m);
    const std::vector<Collider> sphere = {SphereAt(turn * Vector3d(0, -0.03, 0), 0.3)};
    ExpectCleared(*model, sphere, positions_m);
    const ClearStart start = Start(*model, sphere, positions_m);
    ASSERT_EQ(start.clearance, StartClearance::kCleared);
    // The sheet's own middle is above the sphere's 0.3 m, less 0.03 m and what its links span.
    EXPECT_GT((turn.inverse() * start.positions_m[kMiddle]).y(), 0.2);
  }
}

TEST(StartClearance, FromTheMiddleUpwards) {
  const auto model = Sheet();
  const std::vector<Collider> sphere = {SphereAt(kMiddle_m, 0.3)};
  for (const double side : {1.0, -1.0}) {
    const ClearStart start = Start(*model, sphere, Rest(*model), side * kUp);
    ASSERT_EQ(start.clearance, StartClearance::kCleared);
    EXPECT_GT(side * start.positions_m[kMiddle].y(), 0.2);
  }
}

// Two particles at r from the centre, side by side, each R - r deep: outside their distance is R/r
// times as large, so kCaughtRatio is reached at r = R/2.
TEST(StartClearance, HalfTheRadiusIsTooDeep) {
  constexpr double kRadius_m = 1;
  const auto model = Pair({0, 1, 0.1, 0});
  const auto start_at = [&](double r) {
    const double below_m = std::sqrt(r * r - 0.05 * 0.05);
    return Start(*model, {SphereAt({0.05, -below_m, 0}, kRadius_m)}, Rest(*model)).clearance;
  };
  EXPECT_EQ(start_at(1 / kCaughtRatio + 1e-6), StartClearance::kFree);
  EXPECT_EQ(start_at(1 / kCaughtRatio - 1e-6), StartClearance::kCleared);
}

// Millimetres inside are for contacts, also at an edge, where they push to two sides.
TEST(StartClearance, ShallowStartsStayAsTheyAre) {
  const auto model = Build({GridTopology{101, 101, 1, 1}, {}, {}});  // 1 cm links
  for (const double depth_m : {0.001, 0.003, 0.006}) {
    const Collider table = BoxAt({0.5, depth_m - 0.5, 0.5}, {0.3, 0.5, 0.3});
    EXPECT_EQ(Start(*model, {table}, Rest(*model)).clearance, StartClearance::kFree);
  }
  EXPECT_EQ(Start(*model, {PlaneThrough({0, 5, 0}, kUp)}, Rest(*model)).clearance,
            StartClearance::kFree)
      << "a plane has one side, however deep";
}

TEST(StartClearance, OnlyWhatKeepsParticlesTogetherIsCaught) {
  const std::vector<Collider> sphere = {SphereAt({0.05, 0, 0}, 1)};
  const auto clearance = [&](const SceneModel& model) {
    return Start(model, sphere, Rest(model)).clearance;
  };
  EXPECT_EQ(clearance(*Pair({0, 1, 0.1, 0})), StartClearance::kCleared);
  EXPECT_EQ(clearance(*Pair({0, 1, 0.1, 0, ConstraintKind::kAtMost})), StartClearance::kCleared);
  EXPECT_EQ(clearance(*Pair({0, 1, 0.1, 0, ConstraintKind::kAtLeast})), StartClearance::kFree);
  EXPECT_EQ(clearance(*Pair({0, 1, 3, 0, ConstraintKind::kAtMost})), StartClearance::kFree)
      << "a rope that reaches around";
}

// They start under the tension of their description, and no more.
TEST(StartClearance, CompliantLinksGetNoLonger) {
  const auto model = Pair({0, 1, 0.08, 1e-3});
  const ClearStart start = Start(*model, {SphereAt({0.05, 0, 0}, 1)}, Rest(*model));
  ASSERT_EQ(start.clearance, StartClearance::kCleared);
  EXPECT_LE((start.positions_m[1] - start.positions_m[0]).norm(), 0.1 * (1 + kRestoredError));
}

TEST(StartClearance, WhatCannotBeFreedStaysCaught) {
  const auto pinned = Sheet({kMiddle});
  EXPECT_EQ(Start(*pinned, {SphereAt(kMiddle_m, 0.3)}, Rest(*pinned)).clearance,
            StartClearance::kCaught);
  // A wall through the sheet, in all directions farther than the sheet reaches.
  const auto model = Sheet();
  const ClearStart start = Start(*model, {BoxAt({0.5, 0, 0.5}, {0.2, 5, 5})}, Rest(*model));
  EXPECT_EQ(start.clearance, StartClearance::kCaught);
  EXPECT_TRUE(start.positions_m.empty());
}

TEST(StartClearance, IsTheSameEveryTime) {
  const auto model = Sheet({0});
  const std::vector<Collider> sphere = {SphereAt(kMiddle_m, 0.3)};
  const ClearStart a = Start(*model, sphere, Rest(*model)), b = Start(*model, sphere, Rest(*model));
  EXPECT_EQ(a.positions_m, b.positions_m);
}

}  // namespace
}  // namespace drape::test
