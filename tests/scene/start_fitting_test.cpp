#include "server/scene/start_fitting.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/scene/scene_model.h"

namespace drape {
namespace {

using Eigen::Vector3d;

constexpr uint32_t kAround = 24, kAlong = 10;
constexpr double kRadius_m = 0.05, kLength_m = 0.25;

// A tube about the y axis, from y = 0 down. Vertex = row * kAround + column.
TriangleMesh FittingTube() {
  TriangleMesh mesh;
  for (uint32_t r = 0; r <= kAlong; ++r) {
    for (uint32_t c = 0; c < kAround; ++c) {
      const double turn = 2 * std::numbers::pi * (c + 0.5 * (r % 2)) / kAround;
      mesh.positions_m.emplace_back(kRadius_m * std::cos(turn), -kLength_m * r / kAlong,
                                    kRadius_m * std::sin(turn));
    }
  }
  for (uint32_t r = 0; r < kAlong; ++r) {
    for (uint32_t c = 0; c < kAround; ++c) {
      const uint32_t next = (c + 1) % kAround;
      const uint32_t a = r * kAround + c, b = r * kAround + next;
      const uint32_t p = a + kAround, q = b + kAround;
      if (r % 2 == 0) {
        mesh.triangles.push_back({a, b, p});
        mesh.triangles.push_back({b, q, p});
      } else {
        mesh.triangles.push_back({a, b, q});
        mesh.triangles.push_back({a, q, p});
      }
    }
  }
  return mesh;
}

std::shared_ptr<const SceneModel> FittingModel(std::vector<uint32_t> pins = {}) {
  ModelDescription description{.topology = FittingTube(), .material = {}, .pinned_particles = pins};
  description.material.stretch_stiffness_n_per_m = kMeshStretchStiffness_n_per_m;
  return SceneModel::Build(description).value();
}

FittedStart Fit(const SceneModel& model, const Collider& collider) {
  const std::vector<Collider> colliders = {collider};
  return FitStart(model.length_demands(), {colliders, 0.002}, model.rest_positions_m());
}

Collider Arm(double radius_m) {
  return CapsuleBetween({0, 0.2, 0}, {0, -0.5, 0}, radius_m);
}

TEST(StartFitting, ATubeWithRoomStartsAsDrawn) {
  const auto model = FittingModel();
  EXPECT_TRUE(Fit(*model, Arm(0.04)).positions_m.empty());
}

// Within 5 %: contacts widen it, and its fabric stretches.
TEST(StartFitting, ATubeThatIsALittleTightStartsAsDrawn) {
  const auto model = FittingModel();
  EXPECT_TRUE(Fit(*model, Arm(1.04 * kRadius_m - 0.002)).positions_m.empty());
}

// The rings get the arm's circumference; along the arm nothing changes.
TEST(StartFitting, ATightSleeveIsLetOutToTheArm) {
  const auto model = FittingModel();
  for (const double wider : {1.1, 1.3}) {
    SCOPED_TRACE(wider);
    const double arm_m = wider * kRadius_m;
    const FittedStart fitted = Fit(*model, Arm(arm_m - 0.002));
    ASSERT_EQ(fitted.positions_m.size(), model->particle_count());
    for (const Vector3d& p : fitted.positions_m) {
      EXPECT_GE(std::hypot(p.x(), p.z()), arm_m * (1 - 1e-9));
    }
    EXPECT_LE(fitted.errors.max, kNotLetOut);
    // A ring of chords on a wider circle; a diagonal of the zigzag grows less.
    EXPECT_NEAR(fitted.largest_change, wider - 1, 0.02 * wider);
    EXPECT_GE(fitted.let_out.size(), kAround * (kAlong + 1));

    ModelDescription description{.topology = FittingTube(), .material = {}, .pinned_particles = {}};
    description.let_out = fitted.let_out;
    const auto let_out = SceneModel::Build(description).value();
    const auto strain = FindLengthErrors(let_out->length_demands(), fitted.positions_m);
    EXPECT_LE(strain.max, kNotLetOut * (1 + 1e-9));
  }
}

// One side of it is inside a ball, and can give way: nothing is let out by much.
TEST(StartFitting, ATubeThatCanGiveWayKeepsItsLengths) {
  const auto model = FittingModel();
  const FittedStart fitted = Fit(*model, SphereAt({kRadius_m + 0.055, -kLength_m / 2, 0}, 0.06));
  ASSERT_EQ(fitted.positions_m.size(), model->particle_count());
  EXPECT_LE(fitted.largest_change, 0.05);
}

TEST(StartFitting, PinsStay) {
  const auto model = FittingModel({0, 5, 100});
  const FittedStart fitted = Fit(*model, Arm(1.2 * kRadius_m));
  ASSERT_FALSE(fitted.positions_m.empty());
  for (const uint32_t pin : {0u, 5u, 100u}) {
    EXPECT_EQ(fitted.positions_m[pin], model->rest_positions_m()[pin]);
  }
}

}  // namespace
}  // namespace drape
