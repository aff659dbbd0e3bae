// The force of a hinge (method.md, "apply_elastic"): the derivative of an energy, continuous where
// the hinge passes from one side to the other.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <vector>

#include "server/solver/cpu_reference/reference_elastic.h"
#include "server/solver/energy_watch.h"
#include "tests/support/scenes.h"

namespace drape {
namespace {

using Eigen::Vector3d;

constexpr double kNoLimit_per_s2 = 1e18;
constexpr double kRigidity_n_m = 1e-4;

// Two triangles of a few centimetres that are drawn at an angle.
class HingeForcesTest : public testing::Test {
 protected:
  std::shared_ptr<const SceneModel> Hinge(double height_m) {
    TriangleMesh mesh;
    mesh.positions_m = {{0, 0, 0}, {0.04, 0, 0.01}, {0.03, height_m, -0.035}, {0.012, 0, 0.03}};
    mesh.triangles = {{0, 1, 2}, {1, 0, 3}};
    const StructuralMaterial material = {.stretch_stiffness_n_per_m = 2000,
                                         .bending_rigidity_n_m = kRigidity_n_m};
    return test::BuildModel({mesh, material, {}});
  }

  static ParticleState At(std::vector<Vector3d> positions_m) {
    return {positions_m, std::vector<Vector3d>(positions_m.size(), Vector3d::Zero())};
  }

  static std::vector<Vector3d> Forces(const SceneModel& model, const ParticleState& state) {
    return ElasticImpulses(model, state, 1, 1, kNoLimit_per_s2);
  }

  static double Energy_j(const SceneModel& model, const ParticleState& state) {
    const ElasticElement& hinge = model.elastic_elements()[0];
    const double deflection_m =
        DeflectionOf_m(hinge, [&](uint32_t i) { return state.positions_m[i]; });
    return hinge.stiffness_n_per_m / 2 * deflection_m * deflection_m;
  }

  Vector3d Random(double size) {
    std::normal_distribution<double> normal(0, size);
    return {normal(random_), normal(random_), normal(random_)};
  }

  std::mt19937 random_{1};
};

double Largest(const std::vector<Vector3d>& vectors) {
  double largest = 0;
  for (const Vector3d& v : vectors) largest = std::max(largest, v.norm());
  return largest;
}

TEST_F(HingeForcesTest, AreNoneAsDrawn) {
  for (const double height_m : {-0.03, -0.001, 0.0, 0.002, 0.02, 0.2}) {
    const auto model = Hinge(height_m);
    EXPECT_LE(Largest(Forces(*model, test::RestState(*model))), 1e-12) << height_m;
  }
}

// Anywhere: bent either way, folded, crumpled.
TEST_F(HingeForcesTest, AreTheDerivativeOfAnEnergy) {
  constexpr double kStep_m = 1e-8;
  for (int k = 0; k < 300; ++k) {
    const auto model = Hinge(k % 3 == 0 ? 0.0 : 0.01 * (k % 7 - 3));
    std::vector<Vector3d> positions = test::RestState(*model).positions_m;
    for (Vector3d& p : positions) p += Random(k % 2 == 0 ? 0.002 : 0.03);
    const std::vector<Vector3d> forces = Forces(*model, At(positions));
    Vector3d sum = Vector3d::Zero(), torque = Vector3d::Zero();
    for (size_t i = 0; i < 4; ++i) {
      sum += forces[i];
      torque += positions[i].cross(forces[i]);
      for (int axis = 0; axis < 3; ++axis) {
        std::vector<Vector3d> before = positions, after = positions;
        before[i][axis] -= kStep_m;
        after[i][axis] += kStep_m;
        const double slope_n =
            (Energy_j(*model, At(after)) - Energy_j(*model, At(before))) / (2 * kStep_m);
        EXPECT_NEAR(forces[i][axis], -slope_n, 1e-5 * Largest(forces)) << k;
      }
    }
    EXPECT_LE(sum.norm(), 1e-12 * Largest(forces)) << k;
    EXPECT_LE(torque.norm(), 1e-12 * Largest(forces)) << k;
  }
}

// A triangle that is stretched by a thousandth while the hinge passes flat: a force that turned
// round there kept garments in folds from coming to rest.
TEST_F(HingeForcesTest, AreContinuousWhereTheHingeIsFlat) {
  const auto model = Hinge(0.01);
  std::vector<Vector3d> positions = test::RestState(*model).positions_m;
  positions[2] += Vector3d(0.00002, 0, -0.00004);
  constexpr double kStep_m = 1e-7;
  std::vector<Vector3d> before;
  for (double y = -1e-3; y < 1e-3; y += kStep_m) {
    positions[2].y() = y;
    const std::vector<Vector3d> now = Forces(*model, At(positions));
    for (size_t i = 0; i < before.size(); ++i) {
      EXPECT_LE((now[i] - before[i]).norm(), 1e-3 * Largest(now)) << y;
    }
    before = now;
  }
}

}  // namespace
}  // namespace drape
