#include "tests/bench/accuracy/deviations.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace drape::bench {
namespace {

using Eigen::Vector3d;

// Two links of 1 m and 1 kg each end, hanging down from the pinned first particle.
AccuracyScene HangingScene() {
  AccuracyScene scene{.name = "hanging", .title = "two links", .scene = test::Chain(2, 1, 1)};
  scene.scene.state.positions_m = {{0, 0, 0}, {0, -1, 0}, {0, -2, 0}};
  scene.duration_s = 2 * kFrame_s;
  return scene;
}

TEST(DeviationsTest, StrainOfTheWindowOnly) {
  AccuracyScene scene = HangingScene();
  scene.window_start_s = kFrame_s;
  const std::vector<Vector3d> no_reference;
  Observer observer(scene, no_reference);
  ParticleState state = scene.scene.state;
  state.positions_m[2].y() = -9;  // before the window
  observer.Observe(0, state);
  state.positions_m[2].y() = -2.3;
  observer.Observe(1, state);
  state.positions_m[2].y() = -1.9;
  observer.Observe(2, state);
  const Deviations result = observer.Result();
  EXPECT_NEAR(result.max_strain, 0.3, 1e-12);
  EXPECT_NEAR(result.rms_strain, std::sqrt((0.3 * 0.3 + 0.1 * 0.1) / 4), 1e-12);
  EXPECT_TRUE(std::isnan(result.rms_position_m));
  EXPECT_TRUE(std::isnan(result.max_penetration_m));
}

TEST(DeviationsTest, PositionsAtTheEndOfTheFreeParticlesAndSignedEnergy) {
  const AccuracyScene scene = HangingScene();
  std::vector<Vector3d> reference_m = scene.scene.state.positions_m;
  reference_m[1].x() = 0.3;
  reference_m[2].x() = 0.4;
  Observer observer(scene, reference_m);
  ParticleState state = scene.scene.state;
  observer.Observe(0, state);
  state.velocities_m_per_s[1] = {0, 0, 2};  // 2 J gained of m g l = 2 * 9.81 J
  observer.Observe(1, state);
  state.velocities_m_per_s[1] = Vector3d::Zero();
  observer.Observe(2, state);
  const Deviations result = observer.Result();
  EXPECT_NEAR(result.max_position_m, 0.4, 1e-12);
  EXPECT_NEAR(result.rms_position_m, std::sqrt((0.09 + 0.16) / 2), 1e-12);
  EXPECT_NEAR(result.energy_drift, 2 / (2 * 9.81), 1e-12);

  Observer losing(scene, reference_m);
  losing.Observe(0, state);
  state.positions_m[2].y() -= 0.1;
  losing.Observe(2, state);
  EXPECT_NEAR(losing.Result().energy_drift, -0.1 / 2, 1e-12);
}

TEST(DeviationsTest, PenetrationOfParticlesAndOfTheMiddleOfEdgesApart) {
  AccuracyScene scene = HangingScene();
  scene.scene.parameters.thickness_m = 0.01;
  // The second link is a chord of the sphere: its ends on the surface, its middle 0.1 m deep.
  const double radius_m = (0.1 * 0.1 + 0.25) / (2 * 0.1);
  scene.scene.parameters.colliders = {SphereAt(Vector3d(-(radius_m - 0.1), -1.5, 0), radius_m)};
  const std::vector<Vector3d> no_reference;
  Observer observer(scene, no_reference);
  observer.Observe(0, scene.scene.state);
  const Deviations result = observer.Result();
  EXPECT_NEAR(result.max_penetration_m, 0.01, 1e-12);
  EXPECT_NEAR(result.midpoint_penetration_m, 0.11, 1e-12);
  EXPECT_TRUE(std::isnan(result.energy_drift));
  scene.scene.parameters.colliders = {PlaneThrough(Vector3d(0, -5, 0), Vector3d::UnitY())};
  EXPECT_EQ(Penetration_m(scene.scene.parameters, Vector3d(0, 0, 0)), 0);
  EXPECT_NEAR(Penetration_m(scene.scene.parameters, Vector3d(3, -5.5, 1)), 0.51, 1e-12);
}

TEST(DeviationsTest, WhatIsNotFiniteIsNoResult) {
  const AccuracyScene scene = HangingScene();
  const std::vector<Vector3d> no_reference;
  Observer observer(scene, no_reference);
  ParticleState state = scene.scene.state;
  observer.Observe(0, state);
  state.positions_m[1].x() = std::numeric_limits<double>::infinity();
  observer.Observe(1, state);
  EXPECT_TRUE(std::isnan(observer.Result().max_strain));
}

}  // namespace
}  // namespace drape::bench
