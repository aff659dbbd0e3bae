// Whole steps of whole cloths, every backend in single precision against the reference. Few steps:
// a folding cloth enlarges any difference exponentially.
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "tests/parity/round_off.h"
#include "tests/support/backends/backends.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

class WholeStepParityTest : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, WholeStepParityTest, testing::ValuesIn(FloatBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);
// The stage itself is in the short tier (strips_test.cpp).
INSTANTIATE_TEST_SUITE_P(ReductionLong, WholeStepParityTest, testing::Values("gl_reduction"),
                         NameOfCase<testing::TestParamInfo<std::string>>);

void UseSubsteps(Scene& scene, uint32_t substeps) {
  scene.parameters.settings.substeps = substeps;
  scene.parameters.settings.max_iterations = substeps == 1 ? 20 : 2;
  scene.parameters.settings.tolerance = 0;
  scene.name += "_substeps_" + std::to_string(substeps);
}

TEST_P(WholeStepParityTest, AwkwardSizes) {
  for (const uint32_t particle_count : kAwkwardSizes) {
    for (const uint32_t substeps : {1u, 8u}) {
      // Strips see a taut row between two pins as one constraint too many, and rounding decides
      // what it does: with them the cloth is free.
      for (const Sweep sweep : {Sweep::kColours, Sweep::kStrips}) {
        Scene scene = SizedCloth(particle_count, sweep == Sweep::kColours);
        Stir(scene, 0.3);
        UseSubsteps(scene, substeps);
        scene.parameters.settings.sweep = sweep;
        ExpectParity(GetParam(), scene, 2);
      }
    }
  }
}

TEST_P(WholeStepParityTest, ComplianceAndSpringsOfBothIntegrations) {
  for (const auto integration : {SpringIntegration::kInForce, SpringIntegration::kHalfKicks}) {
    for (const uint32_t substeps : {1u, 8u}) {
      Scene scene = CompliantSheet(12, 1e-4);
      Stir(scene, 0.3);
      UseSubsteps(scene, substeps);
      scene.parameters.settings.spring_integration = integration;
      scene.parameters.damping_per_s = 0.5;
      ExpectParity(GetParam(), scene, 2);
    }
  }
}

TEST_P(WholeStepParityTest, WindAndSprings) {
  for (const uint32_t substeps : {1u, 8u}) {
    Scene scene = CompliantSheet(12, 1e-4);
    Stir(scene, 0.3);
    UseSubsteps(scene, substeps);
    scene.parameters.wind_m_per_s = {2, 1, 4};
    scene.parameters.air_drag = 1.2;
    scene.parameters.air_lift = 0.8;
    ExpectParity(GetParam(), scene, 2);
  }
}

TEST_P(WholeStepParityTest, FabricsInTheWind) {
  for (const uint32_t substeps : {1u, 8u}) {
    for (const double stretch_n_per_m : {0.0, 300.0}) {
      Scene scene = Grid(12, 9, 0.5, 0.5, {0},
                         {.stretch_stiffness_n_per_m = stretch_n_per_m,
                          .bending_rigidity_n_m = 1e-4,
                          .shear_modulus_n_per_m = 20});
      Stir(scene, 0.3);
      UseSubsteps(scene, substeps);
      scene.parameters.wind_m_per_s = {2, 1, 4};
      scene.parameters.air_drag = 1.2;
      ExpectParity(GetParam(), scene, 2);
    }
  }
}

TEST_P(WholeStepParityTest, StiffMeshes) {
  for (const uint32_t side : {9u, 33u}) {
    Scene scene = MeshedGrid(side, side, 1, 1, {0}, {.bending_rigidity_n_m = 0.5});
    Stir(scene, 0.3);
    UseSubsteps(scene, 8);
    EXPECT_GT(PlanOf(scene).solver.hinge_stages, 1u);
    ExpectParity(GetParam(), scene, 2);
  }
}

TEST_P(WholeStepParityTest, SlowHingesShareTheirForces) {
  for (const uint32_t side : {9u, 33u}) {
    for (const uint32_t substeps : {8u, 9u, 10u}) {  // four, three or two share
      Scene scene = MeshedGrid(side, side, 1, 1, {0}, {.bending_rigidity_n_m = 1e-6});
      Stir(scene, 0.3);
      UseSubsteps(scene, substeps);
      EXPECT_GT(PlanOf(scene).solver.hinge_period, 1u);
      ExpectParity(GetParam(), scene, 2);
    }
  }
}

TEST_P(WholeStepParityTest, MeshesOfWhichAPartRests) {
  for (const uint32_t side : {9u, 33u}) {
    Scene scene = MeshHalfOnBox(side);
    UseSubsteps(scene, 8);
    EXPECT_TRUE(PlanOf(scene).solver.always_has_remainders() &&
                PlanOf(scene).solver.has_quiet_links);
    ExpectParity(GetParam(), scene, 2);
  }
}

TEST_P(WholeStepParityTest, UnequalMassesInANet) {
  for (const uint32_t substeps : {1u, 8u}) {
    Scene scene = Net(9, 0.1, 1e-5);
    Stir(scene, 0.3);
    UseSubsteps(scene, substeps);
    ExpectParity(GetParam(), scene, 2);
  }
}

TEST_P(WholeStepParityTest, MovingPins) {
  for (const uint32_t substeps : {1u, 8u}) {
    Scene scene = Grid(11, 3, 0.5, 0.1, {0, 11, 22});
    UseSubsteps(scene, substeps);
    for (const uint32_t pin : scene.model->pins()) {
      scene.pin_targets_m.push_back(scene.state.positions_m[pin] +
                                    Eigen::Vector3d(0.01, 0.02, -0.01));
    }
    ExpectParity(GetParam(), scene, 2);
  }
}

TEST_P(WholeStepParityTest, SphereAndPlane) {
  for (const uint32_t substeps : {1u, 8u}) {
    Scene scene = FallingOnSphere(15);
    UseSubsteps(scene, substeps);
    for (auto& v : scene.state.velocities_m_per_s)
      v.y() = -3;  // meets the sphere in the second step
    ExpectParity(GetParam(), scene, 2);
  }
}

// In one work group, and in tiles of a large cloth.
TEST_P(WholeStepParityTest, AMovingSphere) {
  for (const uint32_t side : {15u, 33u}) {
    Scene scene = FallingOnSphere(side);
    UseSubsteps(scene, 8);
    for (const Collider& collider : scene.parameters.colliders) {
      scene.parameters.collider_motions.push_back(RigidMotion::AtRest(CentreOf(collider)));
    }
    scene.parameters.restitution = 0.3;
    scene.parameters.collider_motions[0].velocity_m_per_s = Eigen::Vector3d(0.2, 3, 0.1);
    scene.parameters.collider_motions[0].angular_velocity_rad_per_s = Eigen::Vector3d(0, 2, 1);
    ExpectParity(GetParam(), scene, 2);
    const ClothHandle cloth = CreateCloth(SharedBackend(GetParam()), scene);
    const StepReport report = StepAlone(SharedBackend(GetParam()), cloth, scene, 2, true);
    EXPECT_GT(report.measured.contacts, 0u) << "the scene must touch the sphere";
    SharedBackend(GetParam()).Destroy(cloth);
  }
}

TEST_P(WholeStepParityTest, BoxAndCapsule) {
  // The larger one in tiles.
  for (const auto& [side, substeps] : {std::pair{15u, 1u}, {15u, 8u}, {33u, 8u}}) {
    Scene scene = FallingOnBoxAndCapsule(side);
    // Where they differ, rounding decides whether one of many particles at the limit slips.
    if (side == 33) scene.parameters.friction_dynamic = scene.parameters.friction_static;
    UseSubsteps(scene, substeps);
    for (auto& v : scene.state.velocities_m_per_s) v.y() = -3;  // meets both in the second step
    ExpectParity(GetParam(), scene, 2);
  }
}

// Far from the limit, where rounding decides nothing, by both plans of the GPU: all holds, or all
// slips, first more slowly than what keeps the static coefficient and then faster (kSlipSubsteps).
TEST_P(WholeStepParityTest, SlopesWithTwoFrictions) {
  for (const uint32_t side : {15u, 33u}) {
    for (const double steepness : {0.8, 1.25}) {  // of the slope that static friction holds
      Scene scene = Grid(side, side, 1, 1);
      scene.name += steepness < 1 ? "_holds" : "_slips";
      const Eigen::Quaterniond turn(
          Eigen::AngleAxisd(-std::atan(0.5 * steepness), Eigen::Vector3d::UnitZ()));
      for (Eigen::Vector3d& p : scene.state.positions_m) p = turn * p;
      scene.parameters.colliders = {PlaneThrough({0, 0, 0}, turn * Eigen::Vector3d::UnitY())};
      scene.parameters.friction_static = 0.5;
      scene.parameters.friction_dynamic = 0.35;
      UseSubsteps(scene, 8);
      ExpectParity(GetParam(), scene, 2);
    }
  }
}

// By both plans of the GPU.
TEST_P(WholeStepParityTest, DistanceMap) {
  for (const uint32_t side : {15u, 40u}) {
    for (const uint32_t substeps : {1u, 8u}) {
      Scene scene = FallingOnDistanceMap(side);
      // Where they differ, rounding decides whether a particle at the limit slips.
      scene.parameters.friction_dynamic = scene.parameters.friction_static;
      UseSubsteps(scene, substeps);
      for (auto& v : scene.state.velocities_m_per_s) v.y() = -3;  // meets it in the second step
      ExpectParity(GetParam(), scene, 2);
    }
  }
}

TEST_P(WholeStepParityTest, Tolerance) {
  for (const double tolerance : {1e-2, 1e-3}) {
    // Particles, and links on the longest way to a pin: a row of 31, and 11 x 3.
    for (const auto& [particle_count, path_links] : {std::pair{2u, 1u}, {31u, 30u}, {33u, 7u}}) {
      Scene scene = SizedCloth(particle_count);
      Stir(scene, 0.1);
      scene.parameters.settings.substeps = 8;
      scene.parameters.settings.max_iterations = 10000;
      scene.parameters.settings.tolerance = tolerance;
      ExpectParity(GetParam(), scene, 2, path_links);
    }
  }
}

// Both sides measure by the same function of nearly the same state.
TEST_P(WholeStepParityTest, Measurements) {
  Scene scene = FallingOnSphere(15);
  scene.parameters.settings.substeps = 8;
  scene.parameters.settings.max_iterations = 2;
  for (auto& v : scene.state.velocities_m_per_s) v.y() = -3;
  Backend& reference = SharedBackend("reference");
  Backend& backend = SharedBackend(GetParam());
  const ClothHandle expected_cloth = CreateCloth(reference, scene);
  const ClothHandle actual_cloth = CreateCloth(backend, scene);
  const Measurements expected = StepAlone(reference, expected_cloth, scene, 2, true).measured;
  const Measurements actual = StepAlone(backend, actual_cloth, scene, 2, true).measured;

  const RunScales scales{1.5, 5, 9.81};
  const ErrorBound bound = RoundOffBound(scene, scales, 16, 32);
  const double edge_m = 1.0 / 14;
  const double mass_kg = 0.2;
  EXPECT_NEAR(actual.max_strain, expected.max_strain, 2 * bound.position_m / edge_m);
  EXPECT_NEAR(actual.rms_strain, expected.rms_strain, 2 * bound.position_m / edge_m);
  EXPECT_GT(expected.rms_motion_m, 0);
  EXPECT_NEAR(actual.rms_motion_m, expected.rms_motion_m, 2 * bound.position_m);
  EXPECT_NEAR(actual.kinetic_energy_j, expected.kinetic_energy_j,
              mass_kg * 5 * bound.velocity_m_per_s);
  EXPECT_NEAR(actual.potential_energy_j, expected.potential_energy_j,
              mass_kg * 9.81 * bound.position_m);
  EXPECT_NEAR(actual.lowest_m, expected.lowest_m, bound.position_m);
  EXPECT_NEAR(actual.max_penetration_m, expected.max_penetration_m, bound.position_m);
  EXPECT_NEAR(actual.max_residual_m, expected.max_residual_m, 2 * bound.position_m);
  EXPECT_GT(expected.contacts, 0u) << "the scene must touch the sphere";
  EXPECT_EQ(actual.contacts, expected.contacts);
  reference.Destroy(expected_cloth);
  backend.Destroy(actual_cloth);
}

TEST_P(WholeStepParityTest, StrainEnergyOfCompliantConstraintsAndSprings) {
  Scene scene = CompliantSheet(8, 1e-3);
  Stir(scene, 0.5);
  scene.parameters.settings.substeps = 4;
  scene.parameters.settings.max_iterations = 5;
  Backend& reference = SharedBackend("reference");
  Backend& backend = SharedBackend(GetParam());
  const ClothHandle expected_cloth = CreateCloth(reference, scene);
  const ClothHandle actual_cloth = CreateCloth(backend, scene);
  const Measurements expected = StepAlone(reference, expected_cloth, scene, 1, true).measured;
  const Measurements actual = StepAlone(backend, actual_cloth, scene, 1, true).measured;

  const ErrorBound bound = RoundOffBound(scene, {1.5, 1, 9.81}, 4, 20);
  // dE = C/alpha dC for 112 constraints and k C dC for the springs, each C at most the largest one.
  const double largest_error_m = expected.max_strain / 7;
  const double sum_of_rates = 112 / 1e-3 + scene.model->spring_count() * 2.0;
  EXPECT_GT(expected.strain_energy_j, 0);
  EXPECT_NEAR(actual.strain_energy_j, expected.strain_energy_j,
              sum_of_rates * largest_error_m * 2 * bound.position_m);
  // Lambda alpha/h: as accurate as the error it balances.
  EXPECT_NEAR(actual.max_residual_m, expected.max_residual_m, 4 * bound.position_m);
  reference.Destroy(expected_cloth);
  backend.Destroy(actual_cloth);
}

TEST_P(WholeStepParityTest, TooTightToleranceIsRaised) {
  Scene scene = SizedCloth(33);
  scene.parameters.settings.tolerance = 1e-9;
  Backend& backend = SharedBackend(GetParam());
  ClothHandle cloth = CreateCloth(backend, scene);
  EXPECT_TRUE(StepAlone(backend, cloth, scene).warnings.tolerance_raised);
  backend.Destroy(cloth);

  scene.parameters.settings.tolerance = 1e-3;
  cloth = CreateCloth(backend, scene);
  EXPECT_FALSE(StepAlone(backend, cloth, scene).warnings.tolerance_raised);
  backend.Destroy(cloth);
}

}  // namespace
}  // namespace drape::test
