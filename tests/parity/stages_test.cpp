// Each stage of server/solver/step_stage.h alone, every backend in single precision against the
// reference. Bounds: round_off.h.
#include <gtest/gtest.h>

#include <algorithm>

#include <cmath>

#include "tests/parity/loose_particles.h"
#include "tests/parity/round_off.h"
#include "tests/support/backends/backends.h"
#include "tests/support/constraint_scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class StageParityTest : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, StageParityTest, testing::ValuesIn(FloatBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

TEST_P(StageParityTest, PredictAndIntegrateMoveFreeParticles) {
  for (const uint32_t substeps : {1u, 8u}) {
    Scene scene = LooseParticles({{0, 0, 0}, {1, -2, 3}, {100, 200, -300}});
    scene.state.velocities_m_per_s = {{0, 0, 0}, {3, 4, -5}, {-60, 70, 0.001}};
    SetSubsteps(scene, substeps);
    ExpectParity(GetParam(), scene, 5);
  }
}

TEST_P(StageParityTest, PredictMovesPinsToTheirTargets) {
  for (const uint32_t substeps : {1u, 3u, 8u}) {
    // No constraint, so that the pins are all that moves; one stays.
    Scene scene = Particles({{{0, 0, 0}, {1, 0, 0}, {2, 1, 0}}, {1, 1, 1}, {}, {}}, {0, 1, 2});
    scene.pin_targets_m = {{0.1, -0.2, 0.3}, {1, 0, 0}, {2, 1.7, -0.3}};
    SetSubsteps(scene, substeps);
    ExpectParity(GetParam(), scene, 2);

    Backend& backend = SharedBackend(GetParam());
    const ClothHandle cloth = CreateCloth(backend, scene);
    StepAlone(backend, cloth, scene);
    const ParticleState moved = ReadState(backend, cloth);
    for (size_t k = 0; k < scene.pin_targets_m.size(); ++k) {
      const Vector3d target = RoundToFloat(scene.pin_targets_m[k]);
      EXPECT_EQ(moved.positions_m[k], target) << "a pin ends exactly on its target";
    }
    EXPECT_EQ(moved.velocities_m_per_s[1], Vector3d::Zero()) << "a pin that stays has no speed";
    StepAlone(backend, cloth, scene);
    EXPECT_EQ(ReadState(backend, cloth).velocities_m_per_s[0], Vector3d::Zero());
    backend.Destroy(cloth);
  }
}

// Thrown so fast that every tether is taut; the sweep that follows finds little left to do.
TEST_P(StageParityTest, Tether) {
  for (const uint32_t particle_count : {2u, 33u, 1025u}) {
    for (const bool use_tethers : {false, true}) {
      Scene scene = SizedCloth(particle_count);
      scene.parameters.gravity_m_per_s2.setZero();
      scene.parameters.settings.use_tethers = use_tethers;
      for (uint32_t i = 0; i < particle_count; ++i) {
        if (scene.model->inverse_masses_per_kg()[i] == 0) continue;
        scene.state.velocities_m_per_s[i] = 4 * scene.state.positions_m[i] + Vector3d(0.1, 0, 0.2);
      }
      SetSubsteps(scene, 1);
      ExpectParity(GetParam(), scene, 1);
    }
  }
}

TEST_P(StageParityTest, ApplySprings) {
  for (const auto integration : {SpringIntegration::kInForce, SpringIntegration::kHalfKicks}) {
    for (const uint32_t substeps : {1u, 8u}) {
      ParticleTopology particles;
      particles.positions_m = {{0, 0, 0}, {0.5, 0.1, 0}, {1.1, 0, 0.2}, {3, 1, 2}, {3, 1, 2}};
      particles.masses_kg = {0.5, 0.2, 0.3, 0.4, 0.4};
      // Stretched, compressed and damped springs, and one between coincident particles, which has
      // no direction and exerts no force.
      particles.springs = {
          {0, 1, 0.4, 20, 0}, {1, 2, 0.8, 10, 0.3}, {0, 2, 1, 5, 0.1}, {3, 4, 0.1, 30, 0.2}};
      Scene scene = Particles(particles, {0});
      scene.name = integration == SpringIntegration::kInForce ? "in_force" : "half_kicks";
      scene.parameters.gravity_m_per_s2.setZero();
      scene.parameters.settings.spring_integration = integration;
      scene.state.velocities_m_per_s = {{0, 0, 0}, {1, 0, -1}, {0, 0.5, 0}, {1, 0, 0}, {1, 0, 0}};
      SetSubsteps(scene, substeps);
      ExpectParity(GetParam(), scene, 1);
    }
  }
}

// Moving and curved cloths in wind; the largest coefficients reach every limit of the stage. A
// cloth without triangles (31 x 1) feels nothing.
TEST_P(StageParityTest, ApplyWind) {
  struct Air {
    double drag, lift;
  };
  for (const uint32_t particle_count : {31u, 33u, 1025u}) {
    for (const auto [drag, lift] : {Air{1.2, 0}, Air{0, 1}, Air{1.2, 0.8}, Air{1e3, 1e3}}) {
      for (const uint32_t substeps : {1u, 4u}) {
        Scene scene = SizedCloth(particle_count);
        Stir(scene, 1);
        scene.parameters.gravity_m_per_s2.setZero();
        scene.parameters.wind_m_per_s = {3, 2, -1};
        scene.parameters.air_drag = drag;
        scene.parameters.air_lift = lift;
        SetSubsteps(scene, substeps);
        ExpectParity(GetParam(), scene, 1);
      }
    }
  }
}

// Edges so soft that they do nothing, so that only bending and shear act.
StructuralMaterial Elastic(double rigidity_n_m, double shear_n_per_m) {
  return {.stretch_compliance_m_per_n = 1e12,
          .bending_rigidity_n_m = rigidity_n_m,
          .shear_modulus_n_per_m = shear_n_per_m};
}

void Crumple(Scene& scene) {
  for (Vector3d& p : scene.state.positions_m) {
    p.y() += 0.01 * std::sin(13 * p.x() + 17 * p.z());
    p.x() += 0.003 * std::cos(11 * p.z());
  }
  Stir(scene, 0.5);
  scene.parameters.gravity_m_per_s2.setZero();
}

// A sheet that is curved at rest.
Scene CurvedMesh(uint32_t side, double rigidity_n_m) {
  TriangleMesh mesh;
  for (uint32_t i = 0; i < side * side; ++i) {
    const double x = 0.05 * (i % side), z = 0.05 * (i / side);
    mesh.positions_m.emplace_back(x, 0.02 * std::cos(31 * x + 5 * z), z);
    if (i % side + 1 == side || i / side + 1 == side) continue;
    mesh.triangles.push_back({i, i + side, i + 1});
    mesh.triangles.push_back({i + 1, i + side, i + side + 1});
  }
  Scene scene;
  scene.name = "curved_mesh";
  scene.model = BuildModel({mesh, Elastic(rigidity_n_m, 0), {0, side - 1}});
  scene.state = RestState(*scene.model);
  return scene;
}

// Weak and strong beyond all substeps; both plans of gl; a line has neither twist nor diagonals.
TEST_P(StageParityTest, ApplyElastic) {
  for (const double strength : {1e-6, 1e-3, 1e6}) {
    for (const uint32_t substeps : {1u, 4u}) {
      for (const uint32_t rows : {1u, 3u, 25u}) {
        Scene scene = Grid(rows == 25 ? 41 : 11, rows, 0.5, 0.3, {0, 10},
                           Elastic(strength, rows > 1 ? 1e5 * strength : 0));
        Crumple(scene);
        SetSubsteps(scene, substeps);
        ExpectParity(GetParam(), scene, 1);
      }
      // A crumpled mesh that is stiffer snaps: rounding decides on which side of rest a hinge is.
      Scene mesh = CurvedMesh(strength == 1e-3 ? 33 : 9, std::min(strength, 1e-2));
      Crumple(mesh);
      SetSubsteps(mesh, substeps);
      ExpectParity(GetParam(), mesh, 1);
    }
  }
}

// Nothing is deflected, and stays so to the bit: a flat sheet without noise in its places.
TEST_P(StageParityTest, ApplyElasticToWhatIsAtRest) {
  Scene scene = Grid(5, 3, 1, 0.5, {}, Elastic(1e-3, 10));
  scene.parameters.gravity_m_per_s2.setZero();
  Backend& backend = SharedBackend(GetParam());
  const ClothHandle cloth = CreateCloth(backend, scene);
  const StepReport report = StepAlone(backend, cloth, scene, 1, true);
  EXPECT_LE(report.measured.strain_energy_j, 1e-14);  // of diagonals whose lengths are rounded
  backend.Destroy(cloth);
}

// A sheet at rest in still air, and one that the air meets exactly edge-on.
TEST_P(StageParityTest, ApplyWindWithoutApproach) {
  for (const Vector3d& wind : {Vector3d(0, 0, 0), Vector3d(4, 0, 2)}) {
    Scene scene = Grid(5, 3, 1, 0.5);  // edges without rounding
    scene.parameters.gravity_m_per_s2.setZero();
    scene.parameters.wind_m_per_s = wind;
    scene.parameters.air_drag = scene.parameters.air_lift = 1;
    SetSubsteps(scene, 2);
    ExpectParity(GetParam(), scene, 2);
    Backend& backend = SharedBackend(GetParam());
    const ClothHandle cloth = CreateCloth(backend, scene);
    StepAlone(backend, cloth, scene);
    for (const Vector3d& v : ReadState(backend, cloth).velocities_m_per_s) {
      EXPECT_EQ(v, Vector3d::Zero());
    }
    backend.Destroy(cloth);
  }
}

// Links, compliant links, ropes and struts, joints.
TEST_P(StageParityTest, SolveVelocity) {
  for (const uint32_t particle_count : {2u, 33u, 1025u}) {
    Scene scene = SizedCloth(particle_count);
    Stir(scene, 1);
    scene.parameters.settings.integration = Integration::kOneStep;
    scene.parameters.settings.velocity_iterations = 3;
    SetSubsteps(scene, 2);
    ExpectParity(GetParam(), scene, 1);
  }
  for (Scene scene :
       {CompliantSheet(5, 1e-4), RopesAndStruts(4, 0.2, 0), JointedChain(6, 0.2, 0)}) {
    Stir(scene, 1);
    scene.parameters.settings.integration = Integration::kOneStep;
    scene.parameters.settings.velocity_iterations = 2;
    SetSubsteps(scene, 2);
    ExpectParity(GetParam(), scene, 1);
  }
}

// Two steps, with everything that acts within them.
TEST_P(StageParityTest, PredictTwoSteps) {
  for (const uint32_t particle_count : {33u, 1025u}) {
    for (const uint32_t substeps : {2u, 5u}) {
      Scene scene = SizedCloth(particle_count);
      Stir(scene, 1);
      SetSubsteps(scene, substeps);
      ExpectParity(GetParam(), scene, 1);
      scene.parameters.damping_per_s = 20;
      scene.parameters.wind_m_per_s = {3, 2, -1};
      scene.parameters.air_drag = 1.2;
      for (size_t k = 0; k < scene.pin_targets_m.size(); ++k) {
        scene.pin_targets_m[k] += Vector3d(0.01, 0.02, -0.01);
      }
      ExpectParity(GetParam(), scene, 1);
    }
  }
}

TEST_P(StageParityTest, DampTwist) {
  for (const uint32_t particle_count : {2u, 31u, 33u, 1025u}) {
    for (const Integration integration : {Integration::kOneStep, Integration::kTwoStep}) {
      for (const uint32_t substeps : {1u, 3u, 9u}) {
        Scene scene = SizedCloth(particle_count);
        Stir(scene, 1);
        scene.parameters.settings.twist_damping_per_s = 100;
        scene.parameters.settings.integration = integration;
        SetSubsteps(scene, substeps);
        ExpectParity(GetParam(), scene, 1);
      }
    }
  }
}

TEST_P(StageParityTest, SolveDistanceOneSweep) {
  for (const uint32_t particle_count : {2u, 3u, 31u, 33u, 1025u}) {
    Scene scene = SizedCloth(particle_count);
    Stir(scene, 1);
    scene.parameters.gravity_m_per_s2.setZero();
    scene.parameters.settings.sweep = Sweep::kColours;
    SetSubsteps(scene, 1);
    ExpectParity(GetParam(), scene, 1);
  }
}

TEST_P(StageParityTest, SolveDistanceWithUnequalMassesAndCompliance) {
  for (const double compliance_m_per_n : {0.0, 1e-5, 1e-4, 1e-2}) {
    for (const uint32_t sweeps : {1u, 5u}) {
      Scene scene = Net(7, 0.2, compliance_m_per_n);
      Stir(scene, 2);
      scene.parameters.gravity_m_per_s2.setZero();
      scene.parameters.settings.sweep = Sweep::kColours;
      SetSubsteps(scene, 1, sweeps);
      ExpectParity(GetParam(), scene, 1);
    }
  }
}

TEST_P(StageParityTest, SolveDistanceOfCoincidentParticlesActsAlongX) {
  Scene scene = Particles({{{0, 0, 0}, {0.25, 0, 0}}, {1, 3}, {{0, 1, 0.25, 0}}, {}});
  scene.state.positions_m[1] = scene.state.positions_m[0];
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.settings.sweep = Sweep::kColours;
  SetSubsteps(scene, 1);
  ExpectParity(GetParam(), scene, 1);

  Backend& backend = SharedBackend(GetParam());
  const ClothHandle cloth = CreateCloth(backend, scene);
  StepAlone(backend, cloth, scene);
  const ParticleState state = ReadState(backend, cloth);
  EXPECT_NEAR(state.positions_m[1].x() - state.positions_m[0].x(), 0.25, 0.25 * 8 * 0x1p-24);
  EXPECT_EQ(state.positions_m[1].tail<2>(), Eigen::Vector2d::Zero());
  backend.Destroy(cloth);
}

TEST_P(StageParityTest, CorrectVelocityDamps) {
  Scene scene = LooseParticles({{0, 0, 0}, {1, -2, 3}});
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.damping_per_s = 3;
  scene.state.velocities_m_per_s = {{1, 2, 3}, {-4, 5, 0.01}};
  SetSubsteps(scene, 8);
  ExpectParity(GetParam(), scene, 3);

  Backend& backend = SharedBackend(GetParam());
  const ClothHandle cloth = CreateCloth(backend, scene);
  StepAlone(backend, cloth, scene, 6);
  const double decay = std::exp(-3.0 * 6 / 60);
  // 48 products with a factor of 1 rounding each, and the rounding of the factor itself.
  EXPECT_NEAR(ReadState(backend, cloth).velocities_m_per_s[0].x(), decay, 2 * 48 * 0x1p-24);
  backend.Destroy(cloth);
}

}  // namespace
}  // namespace drape::test
