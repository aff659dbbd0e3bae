#include "tests/bench/accuracy/accuracy_scenes.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/bench/accuracy/deviations.h"
#include "tests/bench/accuracy/hard_scenes.h"

namespace drape::bench {
namespace {

using Eigen::Vector3d;

// A start that violates a constraint, or moves against one, would be an error of the scene.
TEST(AccuracySceneTest, StartUnstretchedAndMoveAcrossTheirEdges) {
  std::set<std::string> names;
  for (const AccuracyScene& scene : AccuracyScenes(false)) {
    EXPECT_TRUE(names.insert(scene.name).second) << scene.name;
    EXPECT_EQ(scene.name.find_first_of(", "), std::string::npos) << scene.name;
    EXPECT_NEAR(scene.duration_s / kFrame_s, scene.frame_count(), 1e-9) << scene.name;
    EXPECT_LT(scene.window_start_frame(), scene.frame_count()) << scene.name;
    const ParticleState& state = scene.scene.state;
    double worst_strain = 0, worst_rate_per_s = 0;
    for (const DistanceConstraint& c : scene.scene.model->constraints()) {
      const Vector3d edge = state.positions_m[c.j] - state.positions_m[c.i];
      const Vector3d change = state.velocities_m_per_s[c.j] - state.velocities_m_per_s[c.i];
      worst_strain = std::max(worst_strain, std::abs(edge.norm() / c.rest_length_m - 1));
      worst_rate_per_s = std::max(worst_rate_per_s,
                                  std::abs(edge.dot(change)) / (c.rest_length_m * c.rest_length_m));
    }
    EXPECT_LT(worst_strain, 1e-12) << scene.name;
    EXPECT_LT(worst_rate_per_s, 1e-12) << scene.name;
  }
  for (const char* name : {"two_corners_32", "two_corners_128", "curtain_32", "curtain_128",
                           "swing_32", "sphere_33", "skirt", "bias_cut"}) {
    EXPECT_TRUE(names.contains(name)) << name;
  }
}

// Threads of a square on the bias: the area is that of the square, the pins at its corners.
TEST(AccuracySceneTest, TheBiasCutIsASquareOfUnevenRows) {
  for (const AccuracyScene& scene : HardScenes()) {
    if (scene.name != "bias_cut") continue;
    const SceneModel& model = *scene.scene.model;
    double mass_kg = 0;
    for (const double m : model.masses_kg()) mass_kg += m;
    EXPECT_NEAR(mass_kg, 0.2, 0.01);
    ASSERT_EQ(model.pin_count(), 2u);
    for (const Vector3d& corner : {Vector3d(0, 0, 0), Vector3d(1, 0, 0)}) {
      const auto off_m = [&](uint32_t pin) {
        return (model.rest_positions_m()[pin] - corner).norm();
      };
      EXPECT_LT(std::min(off_m(model.pins()[0]), off_m(model.pins()[1])), 0.04);
    }
    return;
  }
  FAIL() << "no scene bias_cut";
}

// Two solvers that have nothing in common agree on the curtain.
TEST(AccuracySceneTest, TheTwoReferencesAgree) {
  for (AccuracyScene& scene : AccuracyScenes(true)) {
    if (scene.name != "curtain_6") continue;
    const PositionReference chain = scene.reference();
    SetDirectReference(scene);
    const PositionReference direct = scene.reference();
    EXPECT_EQ(chain.solver, "planar chain");
    EXPECT_EQ(direct.solver, "direct");
    EXPECT_LE(ComparePositions(*scene.scene.model, chain.positions_m, direct.positions_m).max_m,
              chain.error_m + direct.error_m + 1e-10);  // kTolerance, step by step
    return;
  }
  FAIL() << "no scene curtain_6";
}

}  // namespace
}  // namespace drape::bench
