// The rest position of a pinned cloth, and pins that are moved.
#include <cmath>

#include "tests/physics/physics_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
constexpr double kG = 9.81;

class Equilibrium : public PhysicsTest {};

// Let go along a straight line downwards, converged: each of the links is within the tolerance, so
// particle k hangs k links below the pin within k tolerances of a link, and nothing moves sideways.
TEST_P(Equilibrium, AHangingChainIsStraightAndAsLongAsItsLinks) {
  constexpr uint32_t kLinks = 8;
  constexpr double kLink_m = 0.25;
  constexpr double kTolerance = 1e-4;
  Scene scene = Chain(kLinks, kLink_m, 0.05);
  for (uint32_t i = 0; i <= kLinks; ++i) {
    scene.state.positions_m[i] = Vector3d(0, -kLink_m * i, 0);
  }
  scene.parameters.settings = SingleSubstep(1.0 / 60, 5000);
  scene.parameters.settings.substeps = 4;
  scene.parameters.settings.tolerance = kTolerance;
  const ClothHandle cloth = Make(scene);
  const StepReport report = StepAlone(backend(), cloth, scene, 60);
  ASSERT_TRUE(report.converged);
  const ParticleState state = ReadState(backend(), cloth);
  EXPECT_EQ(state.positions_m[0], Vector3d::Zero());
  for (uint32_t k = 1; k <= kLinks; ++k) {
    const double bound = k * kTolerance * kLink_m + 4 * k * round_off() * 2;
    EXPECT_NEAR(state.positions_m[k].y(), -kLink_m * k, bound);
    EXPECT_EQ(state.positions_m[k].x(), 0);
    EXPECT_EQ(state.positions_m[k].z(), 0);
  }
}

// Discrete catenary: the horizontal tension is the same everywhere and each particle adds its
// weight to the vertical one, so tan(theta) of the links is linear in their index. At rest the
// impulses of a substep cancel g h exactly; while they are found, a particle is away from where it
// stays by at most the tension's share of g h^2, which is below N g h^2 here and tilts a link by 2
// N g h^2 / l.
TEST_P(Equilibrium, AChainBetweenTwoPinsIsADiscreteCatenary) {
  constexpr uint32_t kLinks = 8;
  constexpr double kLink_m = 0.125;
  constexpr double kSpan_m = 0.7;
  ParticleTopology chain;
  for (uint32_t i = 0; i <= kLinks; ++i) {
    chain.positions_m.emplace_back(kLink_m * i, 0, 0);
    chain.masses_kg.push_back(0.05);
    if (i > 0) chain.distance_constraints.push_back({i - 1, i, kLink_m, 0});
  }
  Scene scene = Particles(chain, {0, kLinks});
  // From a triangle of the right length, so that it settles soon.
  const double half = kSpan_m / 2;
  const double depth = std::sqrt(0.5 * 0.5 - half * half);
  for (uint32_t i = 0; i <= kLinks; ++i) {
    const double s = i / (kLinks / 2.0);
    scene.state.positions_m[i] = Vector3d(half * s, -depth * (s <= 1 ? s : 2 - s), 0);
  }
  scene.parameters.damping_per_s = 10;
  scene.parameters.settings = SingleSubstep(1.0 / 60, 10);
  scene.parameters.settings.substeps = 32;
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene, 240);
  const ParticleState state = ReadState(backend(), cloth);

  std::vector<double> tangents;
  for (uint32_t i = 0; i < kLinks; ++i) {
    const Vector3d d = state.positions_m[i + 1] - state.positions_m[i];
    tangents.push_back(d.y() / d.x());
  }
  const double h = scene.parameters.settings.substep_s();
  const double steepest_sq = tangents[0] * tangents[0];
  // A second difference is made of 4 tangents; positions are rounded to round_off of 1 m, which the
  // velocities of a substep, C / h, carry on for some substeps.
  const double bound =
      4 * (1 + steepest_sq) * (2 * kLinks * kG * h * h / kLink_m + 16 * round_off() / kLink_m);
  const double mean_step = (tangents.back() - tangents.front()) / (kLinks - 1);
  EXPECT_GT(mean_step, 0.2);
  EXPECT_LT(bound, mean_step / 20) << "the test must be able to tell a catenary from an arc";
  for (uint32_t k = 1; k + 1 < kLinks; ++k) {
    EXPECT_NEAR(tangents[k + 1] - 2 * tangents[k] + tangents[k - 1], 0, bound) << "link " << k;
  }
  EXPECT_NEAR(tangents.front(), -tangents.back(), bound) << "symmetric";
}

class Pins : public PhysicsTest {};

// The numbers that a backend stores, widened again.
Vector3d Stored(ScalarType scalar, const Vector3d& v) {
  return scalar == ScalarType::kFloat64 ? v : RoundToFloat(v);
}

TEST_P(Pins, AreBitForBitAtTheirTargetsAfterTheStep) {
  Scene scene = Grid(5, 4, 0.4, 0.3, {0, 4, 17});
  scene.parameters.settings = SingleSubstep(1.0 / 60, 1);
  scene.parameters.settings.substeps = 7;
  const ClothHandle cloth = Make(scene);
  for (int step = 1; step <= 20; ++step) {
    scene.pin_targets_m = {Vector3d(0.01 * step, 0.003 * step, -0.1 / step),
                           Vector3d(0.4, 0.1 * std::sin(0.3 * step), 0), Vector3d(0.2, 0, 0.3)};
    StepAlone(backend(), cloth, scene);
    const ParticleState state = ReadState(backend(), cloth);
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(state.positions_m[scene.model->pins()[k]], Stored(scalar(), scene.pin_targets_m[k]))
          << "pin " << k << ", step " << step;
    }
  }
  // A long way to a place near the origin: p + h u alone would be off by an ulp of the way.
  scene.pin_targets_m = {Vector3d(1e-5 / 3, -1e-6 / 7, 1e-7 / 9), Vector3d(0.4, 1e-9, 0),
                         Vector3d(-1e-4 / 3, 0, -1e-3 / 7)};
  StepAlone(backend(), cloth, scene);
  const ParticleState near_origin = ReadState(backend(), cloth);
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(near_origin.positions_m[scene.model->pins()[k]],
              Stored(scalar(), scene.pin_targets_m[k]));
  }
  // Without new targets they stay at the last ones.
  scene.pin_targets_m.clear();
  const ParticleState before = ReadState(backend(), cloth);
  StepAlone(backend(), cloth, scene, 3);
  const ParticleState after = ReadState(backend(), cloth);
  for (const uint32_t pin : scene.model->pins()) {
    EXPECT_EQ(after.positions_m[pin], before.positions_m[pin]);
    EXPECT_EQ(after.velocities_m_per_s[pin], Vector3d::Zero());
  }
}

TEST_P(Pins, WithoutTargetsStayWhereTheyStart) {
  Scene scene = Grid(6, 6, 0.7, 0.7, {0, 5});
  scene.parameters.settings.substeps = 11;
  const ClothHandle cloth = Make(scene);
  const ParticleState before = ReadState(backend(), cloth);
  StepAlone(backend(), cloth, scene, 30);
  const ParticleState after = ReadState(backend(), cloth);
  for (const uint32_t pin : scene.model->pins()) {
    EXPECT_EQ(after.positions_m[pin], before.positions_m[pin]);
    EXPECT_EQ(after.velocities_m_per_s[pin], Vector3d::Zero());
  }
  EXPECT_LT(after.positions_m[35].y(), -0.1) << "the rest did move";
}

// A pin moves in a straight line at constant speed: the velocity of its last substep is that of
// all.
TEST_P(Pins, MoveAtConstantSpeed) {
  Scene scene = Grid(2, 2, 1, 1, {0});
  scene.parameters.settings = SingleSubstep(1.0 / 60, 1);
  scene.parameters.settings.substeps = 5;
  scene.pin_targets_m = {Vector3d(0.05, -0.02, 0.03)};
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene);
  const Vector3d velocity = ReadState(backend(), cloth).velocities_m_per_s[0];
  // Each substep rounds the remaining way 3 times and divides by h = 1/300.
  EXPECT_LE((velocity - scene.pin_targets_m[0] * 60).norm(),
            5 * 3 * round_off() * scene.pin_targets_m[0].norm() * 300);
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Equilibrium);
DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Pins);

}  // namespace
}  // namespace drape::test
