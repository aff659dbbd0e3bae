// Scenes that are legal and hard: unequal masses, pins that jump, constraints that cannot all hold.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/solver/solver_constants.h"
#include "tests/support/backends/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class HardSceneTest : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, HardSceneTest, testing::ValuesIn(BackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);
INSTANTIATE_TEST_SUITE_P(ReductionLong, HardSceneTest, testing::Values("gl_reduction"),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// A chain of ten light links with a bob a thousand times as heavy as a link, released horizontally.
Scene HeavyBob() {
  const Scene chain = Chain(10, 0.1, 0.001);
  ParticleTopology particles;
  particles.positions_m = chain.state.positions_m;
  particles.masses_kg.assign(11, 0.001);
  particles.masses_kg.back() = 1;
  for (uint32_t i = 0; i < 10; ++i) particles.distance_constraints.push_back({i, i + 1, 0.1, 0});
  return Particles(particles, {0});
}

// Impulses along the constraints at their end directions take energy and never add any, so the bob
// is never faster than by free fall from its first height to its lowest point.
TEST_P(HardSceneTest, MassRatioOfAThousand) {
  Backend& backend = SharedBackend(GetParam());
  Scene scene = HeavyBob();
  scene.parameters.settings.integration = Integration::kOneStep;
  scene.parameters.settings.sweep = Sweep::kColours;
  scene.parameters.settings.direction = Direction::kAtEnd;
  const ClothHandle cloth = CreateCloth(backend, scene);
  for (int step = 0; step < 120; ++step) {
    const StepReport report = StepAlone(backend, cloth, scene);
    ASSERT_EQ(report.fault, FaultReason::kNone);
    const ParticleState state = ReadState(backend, cloth);
    const double fall_m = -state.positions_m.back().y();
    const double speed = state.velocities_m_per_s.back().norm();
    // The velocity carries up to half a substep of gravity that the next impulses take away again
    // (server/solver/method.md), which is worth a fall of v h/2; doubled for the direction's
    // change.
    const double slack_m = speed * scene.parameters.settings.substep_s();
    EXPECT_LE(speed * speed / 2, 9.81 * (fall_m + slack_m)) << "step " << step;
  }
  backend.Destroy(cloth);
}

// Fabrics a billion times as stiff as any, in folds, thrown onto a sphere: softer than requested,
// with a warning, but never faster than they were thrown and fell (the elements take no more than
// they give; tests/physics/elastic_invariants_test.cpp), with a margin for the contacts.
TEST_P(HardSceneTest, AbsurdBendingAndShear) {
  Backend& backend = SharedBackend(GetParam());
  for (const Preset preset : {Preset::kPaper, Preset::kRealtime}) {
    Scene scene = FallingOnSphere(12);
    scene.model = BuildModel({GridTopology{12, 12, 1, 1},
                              {.bending_rigidity_n_m = 1e6, .shear_modulus_n_per_m = 1e15},
                              {}});
    scene.parameters.settings = PresetSettings(preset);
    for (Vector3d& v : scene.state.velocities_m_per_s) v.y() = -3;
    const ClothHandle cloth = CreateCloth(backend, scene);
    for (int step = 0; step < 60; ++step) {
      const StepReport report = StepAlone(backend, cloth, scene);
      ASSERT_EQ(report.fault, FaultReason::kNone) << PresetName(preset) << " step " << step;
      EXPECT_TRUE(report.warnings.elastic_beyond_limit);
      const ParticleState state = ReadState(backend, cloth);
      for (const Vector3d& v : state.velocities_m_per_s) ASSERT_LE(v.norm(), 2 * (3 + 9.81));
    }
    backend.Destroy(cloth);
  }
}

TEST_P(HardSceneTest, TeleportingPins) {
  Backend& backend = SharedBackend(GetParam());
  Scene scene = Grid(12, 12, 1, 1, {0, 11});
  const ClothHandle cloth = CreateCloth(backend, scene);
  const std::vector<Vector3d> home = {scene.state.positions_m[0], scene.state.positions_m[11]};
  for (int step = 0; step < 60; ++step) {
    scene.pin_targets_m = home;
    if (step % 10 < 5) {
      for (Vector3d& target : scene.pin_targets_m) target += Vector3d(3, 5, -4);
    }
    const StepReport report = StepAlone(backend, cloth, scene);
    ASSERT_EQ(report.fault, FaultReason::kNone) << "step " << step;
  }
  EXPECT_TRUE(IsFinite(ReadState(backend, cloth)));
  backend.Destroy(cloth);
}

// Pins at more than the cloth's length: nothing satisfies every constraint, and nothing breaks.
TEST_P(HardSceneTest, PinsFurtherApartThanTheClothIsLong) {
  Backend& backend = SharedBackend(GetParam());
  Scene scene = Grid(12, 12, 1, 1, {0, 11});
  scene.parameters.settings = PresetSettings(Preset::kPaper);
  scene.pin_targets_m = {Vector3d(-0.5, 0, 0), Vector3d(1.5, 0, 0)};
  const ClothHandle cloth = CreateCloth(backend, scene);
  const StepReport report = StepAlone(backend, cloth, scene, 60, true);
  EXPECT_EQ(report.fault, FaultReason::kNone);
  EXPECT_FALSE(report.converged);
  EXPECT_TRUE(report.warnings.not_converged);
  // The row between the pins is 2 m instead of 1 m long.
  EXPECT_GE(report.measured.max_strain, 1 - 1e-6);
  backend.Destroy(cloth);
}

// A row already straight and taut between two pins has no slack to sag with.
TEST_P(HardSceneTest, StraightTautRow) {
  Backend& backend = SharedBackend(GetParam());
  const Scene scene = Grid(21, 1, 1, 1, {0, 20});
  const ClothHandle cloth = CreateCloth(backend, scene);
  const StepReport report = StepAlone(backend, cloth, scene, 60, true);
  EXPECT_EQ(report.fault, FaultReason::kNone);
  EXPECT_TRUE(IsFinite(ReadState(backend, cloth)));
  EXPECT_LT(report.measured.lowest_m, 0);
  backend.Destroy(cloth);
}

// Rows of 32 links between pins at their ends and, in another one, also between; straight or nearly
// so. One constraint of each part is redundant until the row has sagged until the pivot of its last
// link, the sum of the squares of the turns from link to link (for equal masses), has reached
// kMinStripPivotAtPin; from then on all are solved. The longest row of n links with this sum is a
// parabola, whose turns are all equal: sqrt(p / n), slopes up to n/2 turns, a strain of their
// square over 6. The rounding of a redundant constraint must not stretch it farther.
TEST_P(HardSceneTest, TautRowsSagNoFartherThanTheirPivotsAllow) {
  Backend& backend = SharedBackend(GetParam());
  constexpr uint32_t kLinks = 32;
  for (const std::vector<uint32_t>& pins :
       {std::vector<uint32_t>{0, kLinks}, std::vector<uint32_t>{0, 9, 16, kLinks}}) {
    uint32_t longest = 0;
    for (size_t k = 1; k < pins.size(); ++k) longest = std::max(longest, pins[k] - pins[k - 1]);
    for (const double bend_m : {0.0, 1e-6, 1e-4}) {
      for (const Integration integration : {Integration::kOneStep, Integration::kTwoStep}) {
        ParticleTopology row;
        for (uint32_t i = 0; i <= kLinks; ++i) {
          row.positions_m.emplace_back(0.05 * i, 0, bend_m * std::sin(2.4 * i));
          row.masses_kg.push_back(0.01);
          if (i == 0) continue;
          const double length_m = (row.positions_m[i] - row.positions_m[i - 1]).norm();
          row.distance_constraints.push_back({i - 1, i, length_m, 0});
        }
        Scene scene = Particles(row, pins);
        scene.parameters.settings.integration = integration;
        scene.parameters.settings.direction = Direction::kAtEnd;
        const ClothHandle cloth = CreateCloth(backend, scene);
        for (int step = 0; step < 120; ++step) {
          const StepReport report = StepAlone(backend, cloth, scene, 1, true);
          ASSERT_EQ(report.fault, FaultReason::kNone);
          ASSERT_LE(report.measured.max_strain, kMinStripPivotAtPin * longest / 24)
              << pins.size() << " pins, bent by " << bend_m << " m, step " << step;
        }
        backend.Destroy(cloth);
      }
    }
  }
}

TEST_P(HardSceneTest, LargeAndNoGravity) {
  Backend& backend = SharedBackend(GetParam());
  for (const double gravity : {0.0, 9.81e3}) {
    Scene scene = Grid(12, 12, 1, 1, {0, 11});
    scene.parameters.gravity_m_per_s2 = {0, -gravity, 0};
    const ClothHandle cloth = CreateCloth(backend, scene);
    const StepReport report = StepAlone(backend, cloth, scene, 30, true);
    EXPECT_EQ(report.fault, FaultReason::kNone) << gravity << " m/s^2";
    if (gravity == 0) {
      EXPECT_LE(report.measured.max_strain, 8 * 0x1p-24 * 12) << "nothing moves";
    }
    backend.Destroy(cloth);
  }
}

class SoakLong : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, SoakLong, testing::ValuesIn(BackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

TEST_P(SoakLong, TenThousandSteps) {
  Backend& backend = SharedBackend(GetParam());
  const Scene scene = FallingOnSphere(16);
  const ClothHandle cloth = CreateCloth(backend, scene);
  const StepReport report = StepAlone(backend, cloth, scene, 10000, true);
  EXPECT_EQ(report.fault, FaultReason::kNone);
  EXPECT_TRUE(IsFinite(ReadState(backend, cloth)));
  backend.Destroy(cloth);
}

}  // namespace
}  // namespace drape::test
