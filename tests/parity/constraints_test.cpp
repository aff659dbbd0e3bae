// Joints, inequalities and rest lengths that change, every backend in single precision against the
// reference. Bounds: round_off.h. Sizes of both plans of the GL backend.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/parity/round_off.h"
#include "tests/support/backends/backends.h"
#include "tests/support/constraint_scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class ConstraintParityTest : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, ConstraintParityTest, testing::ValuesIn(FloatBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

void SetSubsteps(Scene& scene, uint32_t substeps, uint32_t max_iterations) {
  scene.parameters.settings.substeps = substeps;
  scene.parameters.settings.max_iterations = max_iterations;
}

TEST_P(ConstraintParityTest, SolveJoints) {
  for (const uint32_t links : {1u, 2u, 17u, 520u}) {
    for (const double compliance_m_per_n : {0.0, 1e-4}) {
      for (const auto& [substeps, sweeps] : {std::pair{1u, 1u}, {1u, 5u}, {6u, 2u}}) {
        Scene scene = JointedChain(links, 0.1, compliance_m_per_n);
        Stir(scene, 1);
        SetSubsteps(scene, substeps, sweeps);
        ExpectParity(GetParam(), scene, 2);
      }
    }
  }
}

// Several joints of one particle are of different colours; particles that are apart are pulled
// together; a joint to a pin moves the free particle alone.
TEST_P(ConstraintParityTest, JointsOfOneParticle) {
  ParticleTopology star;
  star.positions_m = {{0, 0, 0}, {0.01, 0, 0}, {0, 0.02, 0}, {0, 0, 0.03}, {0.5, 0, 0}};
  star.masses_kg = {0.1, 0.2, 0.3, 0.4, 0.5};
  star.point_joints = {{0, 1, 0}, {0, 2, 0}, {3, 0, 1e-4}, {1, 2, 0}, {4, 3, 0}};
  for (const std::vector<uint32_t>& pins : {std::vector<uint32_t>{}, {4}}) {
    Scene scene = Particles(star, pins);
    SetSubsteps(scene, 2, 3);
    ExpectParity(GetParam(), scene, 2);
  }
}

TEST_P(ConstraintParityTest, RopesAndStruts) {
  for (const uint32_t side : {3u, 7u, 33u}) {
    for (const double compliance_m_per_n : {0.0, 1e-4}) {
      for (const auto& [substeps, sweeps] : {std::pair{1u, 1u}, {1u, 6u}, {6u, 2u}}) {
        Scene scene = RopesAndStruts(side, 0.1, compliance_m_per_n);
        Stir(scene, 1);
        SetSubsteps(scene, substeps, sweeps);
        ExpectParity(GetParam(), scene, 2);
      }
    }
  }
}

// The first step takes the lengths to their targets, the next ones keep them there.
TEST_P(ConstraintParityTest, DrivenLengths) {
  for (const uint32_t side : {3u, 7u, 33u}) {
    for (const double compliance_m_per_n : {0.0, 1e-4}) {
      for (const auto& [substeps, sweeps] : {std::pair{1u, 3u}, {5u, 2u}}) {
        Scene scene = RopesAndStruts(side, 0.1, compliance_m_per_n);
        scene.rest_length_targets_m = UnevenLengths(*scene.model, 0.02);
        SetSubsteps(scene, substeps, sweeps);
        ExpectParity(GetParam(), scene, 3);
      }
    }
  }
}

TEST_P(ConstraintParityTest, DrivenLengthsOfPlainConstraints) {
  for (const uint32_t particle_count : {33u, 1025u}) {
    Scene scene = SizedCloth(particle_count);
    scene.rest_length_targets_m = UnevenLengths(*scene.model, -0.03);
    SetSubsteps(scene, 4, 2);
    ExpectParity(GetParam(), scene, 2);
  }
}

TEST_P(ConstraintParityTest, Tolerance) {
  Scene scene = JointedChain(4, 0.1, 0);
  Stir(scene, 0.1);
  SetSubsteps(scene, 8, 10000);
  scene.parameters.settings.tolerance = 1e-3;
  ExpectParity(GetParam(), scene, 2, 8);

  Scene ropes = RopesAndStruts(3, 0.1, 0);
  Stir(ropes, 0.1);
  SetSubsteps(ropes, 8, 10000);
  ropes.parameters.settings.tolerance = 1e-3;
  ExpectParity(GetParam(), ropes, 2, 8);
}

// Several pieces, driven lengths, and all that adds to the strain, its energy and the residual.
TEST_P(ConstraintParityTest, Measurements) {
  for (Scene scene : {JointedChain(9, 0.1, 1e-3), JointedChain(1100, 0.1, 1e-3),
                      RopesAndStruts(7, 0.1, 1e-3), RopesAndStruts(40, 0.1, 1e-3)}) {
    SCOPED_TRACE(scene.name);
    Stir(scene, 0.5);
    SetSubsteps(scene, 2, 3);
    scene.rest_length_targets_m = UnevenLengths(*scene.model, 0.01);
    Backend& reference = SharedBackend("reference");
    Backend& backend = SharedBackend(GetParam());
    const ClothHandle expected_cloth = CreateCloth(reference, scene);
    const ClothHandle actual_cloth = CreateCloth(backend, scene);
    const Measurements expected = StepAlone(reference, expected_cloth, scene, 1, true).measured;
    const Measurements actual = StepAlone(backend, actual_cloth, scene, 1, true).measured;
    const double extent_m = scene.state.positions_m.back().norm() + 0.1;
    const ErrorBound bound = RoundOffBound(scene, {extent_m, 1, 9.81}, 2, 6);
    EXPECT_GT(expected.max_strain, 1e-3);
    EXPECT_NEAR(actual.max_strain, expected.max_strain, 2 * bound.position_m / 0.099);
    EXPECT_NEAR(actual.rms_strain, expected.rms_strain, 2 * bound.position_m / 0.099);
    const double strain_bound = 2 * bound.position_m / 0.099;
    EXPECT_NEAR(actual.strain_p50, expected.strain_p50, expected.strain_p50 / 128 + strain_bound);
    EXPECT_NEAR(actual.strain_p90, expected.strain_p90, expected.strain_p90 / 128 + strain_bound);
    EXPECT_NEAR(actual.strain_p99, expected.strain_p99, expected.strain_p99 / 128 + strain_bound);
    EXPECT_NEAR(actual.rms_motion_m, expected.rms_motion_m, 2 * bound.position_m);
    EXPECT_GT(expected.max_residual_m, 0);
    // Lambda alpha/h: as accurate as the error it balances.
    EXPECT_NEAR(actual.max_residual_m, expected.max_residual_m, 4 * bound.position_m);
    // dE = C/alpha dC; the errors of joints and constraints are below 2 cm here.
    const double count = scene.model->constraint_count() + scene.model->joint_count();
    EXPECT_GT(expected.strain_energy_j, 0);
    EXPECT_NEAR(actual.strain_energy_j, expected.strain_energy_j,
                count / 1e-3 * 0.02 * 2 * bound.position_m);
    reference.Destroy(expected_cloth);
    backend.Destroy(actual_cloth);
  }
}

// With the least compliances it is more than a number can hold, or close to it, and never none.
TEST_P(ConstraintParityTest, StrainEnergyOfTinyCompliancesIsANumber) {
  for (const double compliance_m_per_n : {1e-38, 1e-40, 1e-42, 1e-44, 1e-45}) {
    for (Scene scene :
         {CompliantSheet(8, compliance_m_per_n), CompliantSheet(64, compliance_m_per_n),
          JointedChain(9, 0.1, compliance_m_per_n), RopesAndStruts(40, 0.1, compliance_m_per_n)}) {
      SCOPED_TRACE(scene.name + " " + std::to_string(std::log10(compliance_m_per_n)));
      Stir(scene, 0.5);
      SetSubsteps(scene, 2, 3);
      for (const char* name : {"reference", GetParam().c_str()}) {
        Backend& backend = SharedBackend(name);
        const ClothHandle cloth = CreateCloth(backend, scene);
        const Measurements measured = StepAlone(backend, cloth, scene, 1, true).measured;
        EXPECT_GE(measured.strain_energy_j, 0) << name << ": not a number, where it is nan";
        backend.Destroy(cloth);
      }
    }
  }
}

}  // namespace
}  // namespace drape::test
