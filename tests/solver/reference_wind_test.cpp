// The law of the air on one triangle, and its guarantees for any numbers.
#include "server/solver/cpu_reference/reference_wind.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "server/solver/solver_constants.h"
#include "tests/support/scenes.h"

namespace drape {
namespace {

using Eigen::Vector3d;

ClothParameters Air(double drag, double lift) {
  ClothParameters parameters = test::PlainParameters();
  parameters.air_drag = drag;
  parameters.air_lift = lift;
  return parameters;
}

Vector3d RandomVector(std::mt19937& random, double size) {
  std::normal_distribution<double> normal;
  return size * Vector3d(normal(random), normal(random), normal(random));
}

// For short times the change is the force over the mass: drag along r, lift across it towards the
// lee side, both times rho/2 A cos r^2; the effect of the limits is second order in the time.
TEST(VelocityAfterAirTest, IsTheFlatPlateLawForShortTimes) {
  const Vector3d r(3, 4, 0);
  const Vector3d area(0, 0.7, 0);  // cos = 0.8, sin = 0.6
  const double mass = 0.1, duration = 1e-6;
  const double pressure = kAirDensity_kg_per_m3 / 2 * 25;
  const Vector3d drag = 1.3 * pressure * 0.7 * 0.8 * Vector3d(0.6, 0.8, 0);
  const Vector3d lift = 0.9 * pressure * 0.7 * 0.8 * 0.6 * Vector3d(-0.8, 0.6, 0);
  const Vector3d change = r - VelocityAfterAir(r, area, mass, Air(1.3, 0.9), duration);
  EXPECT_LE((change - (drag + lift) * duration / mass).norm(), 1e-3 * change.norm());
  const Vector3d flipped = r - VelocityAfterAir(r, -area, mass, Air(1.3, 0.9), duration);
  EXPECT_EQ(change, flipped) << "a triangle has no front";
}

// r' is a difference of numbers up to kMaxAirRatio times as large.
TEST(VelocityAfterAirTest, NeverLengthensOrReverses) {
  std::mt19937 random(5);
  const double rounding = kMaxAirRatio * 0x1p-50;
  for (const double coefficient : {0.1, 1.0, kMaxAirCoefficient}) {
    for (const double duration : {1e-4, 1.0 / 60, 10.0}) {
      for (int k = 0; k < 200; ++k) {
        const Vector3d r = RandomVector(random, k % 2 == 0 ? 1 : 1000);
        const Vector3d area = RandomVector(random, 0.01);
        const ClothParameters air = Air(k % 3 == 0 ? 0 : coefficient, k % 3 == 1 ? 0 : coefficient);
        const Vector3d after = VelocityAfterAir(r, area, 0.002, air, duration);
        EXPECT_LE(after.norm(), r.norm() * (1 + rounding));
        const double approach = after.dot(area) * (r.dot(area) < 0 ? -1 : 1);
        EXPECT_GE(approach, -rounding * area.norm() * r.norm());
      }
    }
  }
}

TEST(VelocityAfterAirTest, LiftAloneTurns) {
  const Vector3d r(3, 4, 0);
  for (const double duration : {1e-3, 1.0}) {
    const Vector3d after = VelocityAfterAir(r, {0, 0.7, 0}, 0.1, Air(0, 2), duration);
    EXPECT_NEAR(after.norm(), 5, 1e-14);
    EXPECT_LT(after.y(), 4);
  }
}

// Kinetic energy seen from the air is never gained, on a crumpled sheet, grids included, at any
// strength: each particle's change is the mean of what single triangles would do to its shares.
TEST(WindVelocityChangesTest, NeverGainEnergyRelativeToTheAir) {
  std::mt19937 random(7);
  test::Scene scene = test::Grid(9, 6, 1, 0.7);
  for (Vector3d& p : scene.state.positions_m) p += RandomVector(random, 0.1);
  for (Vector3d& v : scene.state.velocities_m_per_s) v = RandomVector(random, 20);
  for (const double coefficient : {1.0, 30.0, kMaxAirCoefficient}) {
    for (const double duration : {1e-3, 1.0 / 60, 10.0}) {
      for (const bool has_lift : {false, true}) {
        ClothParameters parameters = Air(coefficient, has_lift ? coefficient : 0);
        parameters.wind_m_per_s = {10, -5, 30};
        const auto changes = WindVelocityChanges(*scene.model, parameters, scene.state, duration);
        double before = 0, after = 0;
        for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
          const Vector3d r = scene.state.velocities_m_per_s[i] - parameters.wind_m_per_s;
          before += scene.model->masses_kg()[i] * r.squaredNorm();
          after += scene.model->masses_kg()[i] * (r + changes[i]).squaredNorm();
        }
        EXPECT_LT(after, before);
      }
    }
  }
}

}  // namespace
}  // namespace drape
