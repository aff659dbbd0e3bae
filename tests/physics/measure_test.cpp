// Measures in reports: percentiles of strain, the warning where it is large, motion.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/solver/solver_constants.h"
#include "tests/physics/physics_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class StrainReport : public PhysicsTest {};
DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(StrainReport);

std::vector<double> SortedStrains(const SceneModel& model, const ParticleState& state) {
  std::vector<double> strains;
  for (const DistanceConstraint& constraint : model.constraints()) {
    const Vector3d d = state.positions_m[constraint.j] - state.positions_m[constraint.i];
    strains.push_back(std::abs(d.norm() / constraint.rest_length_m - 1));
  }
  std::sort(strains.begin(), strains.end());
  return strains;
}

// Sheets of 4, 12, 112, 840 and 5100 links, stretched here and there by too few sweeps.
TEST_P(StrainReport, PercentilesAreThoseOfSortedStrains) {
  for (const uint32_t side : {2u, 3u, 8u, 21u, 51u}) {
    Scene scene = Grid(side, side, 1, 1, {0, side - 1});
    scene.parameters.settings.substeps = 4;
    scene.parameters.settings.max_iterations = 2;
    const ClothHandle cloth = Make(scene);
    const Measurements measured = StepAlone(backend(), cloth, scene, 6, true).measured;
    const std::vector<double> strains = SortedStrains(*scene.model, ReadState(backend(), cloth));
    // Two positions within 2 m are rounded, and a length.
    const double rounding = 8 * round_off() * side;
    const auto expect = [&](size_t percent, double found) {
      const double exact = strains[(strains.size() * percent + 99) / 100 - 1];
      EXPECT_LE(found, exact + rounding) << percent << " % of " << strains.size();
      EXPECT_GE(found, exact * (1 - 0x1p-7) - rounding - kMinPercentile)
          << percent << " % of " << strains.size();
    };
    expect(50, measured.strain_p50);
    expect(90, measured.strain_p90);
    expect(99, measured.strain_p99);
    EXPECT_LE(measured.strain_p99, measured.max_strain);
  }
}

TEST_P(StrainReport, WithoutLinksThereIsNone) {
  const Scene scene = Particles({{{0, 0, 0}, {1, 0, 0}}, {1, 1}, {}, {}});
  const ClothHandle cloth = Make(scene);
  const Measurements measured = StepAlone(backend(), cloth, scene, 1, true).measured;
  EXPECT_EQ(measured.strain_p50, 0);
  EXPECT_EQ(measured.strain_p99, 0);
}

// Two rods in a line between two pins too far apart, which no solver can bring to their lengths: a
// sweep ends with one of them at its length, and the other has the strain of both.
// Soft rods may stretch by 5 % and by what the whole weight of 9.81 N would do to them.
TEST_P(StrainReport, WarnsOfStrainThatTheMaterialDoesNotExplain) {
  for (const double strain : {0.02, 0.03, 0.07}) {
    for (const double compliance_m_per_n : {0.0, 1e-6, 0.1}) {
      for (const bool measure : {false, true}) {
        Scene scene = Particles({{{0, 0, 0}, {1 + strain, 0, 0}, {2 + 2 * strain, 0, 0}},
                                 {1, 1, 1},
                                 {{0, 1, 1, compliance_m_per_n}, {1, 2, 1, compliance_m_per_n}},
                                 {}},
                                {0, 2});
        scene.parameters.gravity_m_per_s2 = {0, 0, 9.81};
        scene.parameters.settings = SingleSubstep(1.0 / 60);
        const ClothHandle cloth = Make(scene);
        const StepReport report = StepAlone(backend(), cloth, scene, 1, measure);
        const bool is_soft = compliance_m_per_n == 0.1;
        EXPECT_EQ(report.warnings.strain_beyond_limit, measure && !is_soft && 2 * strain > 0.05)
            << strain << ", " << compliance_m_per_n << " m/N";
        if (measure && is_soft) {
          EXPECT_NEAR(report.measured.max_strain, strain, 1e-3);
        }
      }
    }
  }
}

class MotionReport : public PhysicsTest {};
DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(MotionReport);

// Of 9, 2025 and 2116 particles, the last of which gl measures in two pieces. A pin moves.
TEST_P(MotionReport, IsThatOfTheStatesAroundTheLastStep) {
  for (const uint32_t side : {3u, 45u, 46u}) {
    Scene scene = Grid(side, side, 1, 1, {0, side - 1});
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene, 2);
    const std::vector<Vector3d> start_m = ReadState(backend(), cloth).positions_m;
    scene.pin_targets_m = {start_m[0] + Vector3d(0.01, 0, 0), start_m[side - 1]};
    const Measurements measured = StepAlone(backend(), cloth, scene, 1, true).measured;
    const std::vector<Vector3d> end_m = ReadState(backend(), cloth).positions_m;
    EXPECT_NEAR((end_m[0] - start_m[0]).norm(), 0.01, 1e-6);
    double sum_sq = 0;
    for (size_t i = 0; i < end_m.size(); ++i) sum_sq += (end_m[i] - start_m[i]).squaredNorm();
    const double expected = std::sqrt(sum_sq / static_cast<double>(end_m.size()));
    // Squares, a compensated sum, a quotient and a root, each rounded.
    EXPECT_NEAR(measured.rms_motion_m, expected, 8 * round_off() * expected) << side;
  }
}

TEST_P(MotionReport, AFaultedClothHasNone) {
  Scene scene = LoneParticle({0, 0, 0}, {2 * kMaxSpeed_m_per_s, 0, 0});
  const ClothHandle cloth = Make(scene);
  for (int step = 0; step < 2; ++step) {
    const StepReport report = StepAlone(backend(), cloth, scene, 1, true);
    EXPECT_NE(report.fault, FaultReason::kNone);
    EXPECT_EQ(report.measured.rms_motion_m, 0);
  }
}

class BalanceReport : public PhysicsTest {
 protected:
  bool IsTold(const Scene& scene) {
    return StepAlone(backend(), Make(scene), scene).energy.has_value();
  }
};
INSTANTIATE_TEST_SUITE_P(Backends, BalanceReport, testing::ValuesIn(OwnBackendNames()),
                         [](const auto& one) { return one.param; });

TEST_P(BalanceReport, AddsUpToTheEnergiesThatAreMeasured) {
  constexpr int kSteps = 40;
  for (const Preset preset : {Preset::kRealtime, Preset::kPaper}) {
    Scene scene = Grid(9, 7, 1, 0.7, {0, 8});
    scene.parameters.settings = PresetSettings(preset);
    const ClothHandle cloth = Make(scene);
    double sum_j = 0, first_j = 0, last_j = 0, scale_j = 0;
    for (int step = 0; step <= kSteps; ++step) {
      const StepReport report = StepAlone(backend(), cloth, scene, 1, true);
      const Measurements& measured = report.measured;
      last_j = measured.kinetic_energy_j + measured.potential_energy_j;
      scale_j = std::max(scale_j, measured.kinetic_energy_j + std::abs(last_j));
      ASSERT_TRUE(report.energy.has_value());
      EXPECT_GT(report.energy->scale_j, 0);
      if (step == 0) {
        first_j = last_j;
      } else {
        sum_j += report.energy->gain_j;
      }
    }
    EXPECT_LT(last_j, first_j - 1e-3 * scale_j) << "it loses some, so there is a sum";
    // In each step the squares and products of three coordinates, rounded and added up.
    EXPECT_NEAR(sum_j, last_j - first_j, 16 * kSteps * round_off() * scale_j);
  }
}

TEST_P(BalanceReport, IsNotToldWhereSomethingElseHasPartInIt) {
  const Scene bare = Grid(5, 5, 1, 1, {0, 4});
  EXPECT_TRUE(IsTold(bare));
  Scene scene = bare;
  scene.pin_targets_m = {scene.state.positions_m[0] + Vector3d(0, 0.001, 0),
                         scene.state.positions_m[4]};
  EXPECT_FALSE(IsTold(scene)) << "a pin moves";
  scene = bare;
  scene.parameters.colliders = {SphereAt({0.5, -0.26, 0.5}, 0.25)};
  EXPECT_FALSE(IsTold(scene));
  scene = bare;
  scene.parameters.air_drag = 1;
  scene.parameters.wind_m_per_s = {1, 0, 0};
  EXPECT_FALSE(IsTold(scene));
  EXPECT_FALSE(IsTold(Grid(5, 5, 1, 1, {0, 4}, {.bending_rigidity_n_m = 1e-4})));
  EXPECT_FALSE(IsTold(Grid(5, 5, 1, 1, {0, 4}, {.stretch_compliance_m_per_n = 1e-4})));
}

}  // namespace
}  // namespace drape::test
