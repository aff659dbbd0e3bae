// Point joints: articulated systems, with cycles, out of rods whose ends are joined (Bender et al.
// 2009, section 3.2).
#include <algorithm>
#include <cmath>

#include "tests/physics/physics_test.h"
#include "tests/support/constraint_scenes.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class Joints : public PhysicsTest {};

// Two particles that fly apart, joined: one impulse gives both the velocity with which they are at
// one place at the end of the step, which is where their centre of mass is. Rounded are the
// difference, the impulse, two velocities and two positions: 16 operations of at most 4 m/s or 1 m.
TEST_P(Joints, OneImpulseIsExact) {
  Scene scene = Particles(
      {{Vector3d(0.25, 0, 0), Vector3d(0.5, 0.25, -0.125)}, {0.5, 0.25}, {}, {}, {{0, 1, 0}}});
  scene.parameters.gravity_m_per_s2.setZero();
  scene.state.velocities_m_per_s = {{1, 2, -1}, {-2, 1, 3}};
  scene.parameters.settings = SingleSubstep(0.125);
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene);
  const ParticleState state = ReadState(backend(), cloth);
  const double bound = 16 * round_off() * 4;
  EXPECT_LE((state.positions_m[0] - state.positions_m[1]).norm(), bound);
  const Vector3d center = (scene.state.positions_m[0] * 2 + scene.state.positions_m[1]) / 3 +
                          0.125 * Vector3d(0, 5, 1) / 3;
  EXPECT_LE((state.positions_m[0] - center).norm(), bound);
}

// C = alpha m g along the axis of gravity, at any number of sweeps.
TEST_P(Joints, ACompliantJointSagsAsItsLoadSays) {
  constexpr double kCompliance_m_per_n = 1.0 / 64;
  for (const uint32_t sweeps : {1u, 2u, 10u}) {
    Scene scene = Particles(
        {{Vector3d::Zero(), Vector3d::Zero()}, {1, 0.5}, {}, {}, {{0, 1, kCompliance_m_per_n}}},
        {0});
    scene.state.positions_m[1].y() = -kCompliance_m_per_n * 0.5 * 9.81;
    // At rest the velocity carries the half step of gravity that the next impulse takes away.
    scene.parameters.settings = SingleSubstep(1.0 / 64, sweeps);
    scene.state.velocities_m_per_s[1].y() = -9.81 / 128;
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene, 20);
    // 20 steps of a stable equilibrium, 10 operations of 0.1 m or 0.1 m/s each.
    EXPECT_NEAR(ReadState(backend(), cloth).positions_m[1].y(), scene.state.positions_m[1].y(),
                20 * 10 * sweeps * round_off() * 0.1)
        << sweeps;
  }
}

TEST_P(Joints, KeepTheMomentum) {
  constexpr uint32_t kSteps = 10;
  Scene pinned = JointedChain(6, 0.2, 0);
  ParticleTopology particles;
  particles.positions_m = pinned.state.positions_m;
  particles.masses_kg.assign(pinned.model->masses_kg().begin(), pinned.model->masses_kg().end());
  const auto joints = pinned.model->joints();
  particles.point_joints.assign(joints.begin(), joints.end());
  const auto rods = pinned.model->constraints();
  particles.distance_constraints.assign(rods.begin(), rods.end());
  Scene scene = Particles(particles);
  Stir(scene, 1);
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.settings = SingleSubstep(1.0 / 60, 4);
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene, kSteps);
  const ParticleState state = ReadState(backend(), cloth);
  Vector3d change = Vector3d::Zero();
  double total_mass = 0;
  double largest_speed = 1;
  for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
    change += scene.model->masses_kg()[i] *
              (state.velocities_m_per_s[i] - scene.state.velocities_m_per_s[i]);
    total_mass += scene.model->masses_kg()[i];
    largest_speed = std::max(largest_speed, state.velocities_m_per_s[i].norm());
  }
  // 4 roundings of a velocity per impulse, two impulses per particle and sweep.
  EXPECT_LE(change.norm(), 4.0 * 2 * 4 * kSteps * round_off() * total_mass * 2 * largest_speed);
  EXPECT_GT((state.velocities_m_per_s[3] - scene.state.velocities_m_per_s[3]).norm(), 0.05);
}

// The end of a double pendulum of 1 m and 0.5 m, 0.4 s after its horizontal release. Its elbow is
// one particle, or two joined ones that weigh as much together.
Vector3d EndOfDoublePendulum(Backend& backend, bool has_joint, uint32_t substeps) {
  ParticleTopology particles;
  if (has_joint) {
    particles.positions_m = {{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0.5}};
    particles.masses_kg = {1, 0.125, 0.375, 0.25};
    particles.distance_constraints = {{0, 1, 1, 0}, {2, 3, 0.5, 0}};
    particles.point_joints = {{1, 2, 0}};
  } else {
    particles.positions_m = {{0, 0, 0}, {1, 0, 0}, {1, 0, 0.5}};
    particles.masses_kg = {1, 0.5, 0.25};
    particles.distance_constraints = {{0, 1, 1, 0}, {1, 2, 0.5, 0}};
  }
  Scene scene = Particles(particles, {0});
  scene.parameters.settings = SingleSubstep(0.4, 200);
  scene.parameters.settings.substeps = substeps;
  const ClothHandle cloth = CreateCloth(backend, scene);
  StepAlone(backend, cloth, scene);
  const Vector3d end = ReadState(backend, cloth).positions_m.back();
  backend.Destroy(cloth);
  return end;
}

// Both schemes are of first order in the substep, so what differs between them halves with it, and
// what is left after extrapolation is of second order.
TEST_P(Joints, ADoublePendulumOfTwoRodsMovesAsOneWithASharedParticle) {
  if (scalar() == ScalarType::kFloat32) {
    // Round-off of 200 substeps hides the order; the motions have to agree as the reference's do.
    const double coarse = (EndOfDoublePendulum(backend(), true, 200) -
                           EndOfDoublePendulum(SharedBackend("reference"), true, 200))
                              .norm();
    EXPECT_LT(coarse, 1e-3);
    return;
  }
  std::vector<double> differences;
  std::vector<Vector3d> ends;
  for (const uint32_t substeps : {200u, 400u, 800u}) {
    const Vector3d joined = EndOfDoublePendulum(backend(), true, substeps);
    const Vector3d shared = EndOfDoublePendulum(backend(), false, substeps);
    differences.push_back((joined - shared).norm());
    ends.push_back(joined - shared);
  }
  EXPECT_LT(differences[0], 5e-3);
  EXPECT_LT(differences[1], 0.6 * differences[0] + 1e-9);
  EXPECT_LT(differences[2], 0.6 * differences[1] + 1e-9);
  EXPECT_LT((2 * ends[2] - ends[1]).norm(), 0.2 * differences[1] + 1e-9);
}

// Ground, crank, coupler and rocker: three rods, two joints and a joint to a pin close a cycle.
// With a tolerance every joint and rod is as good as that at the end of every substep. An error of
// the longest rod l makes velocities wrong by at most tolerance l / h = 0.05 m/s, and so the energy
// of 0.8 kg at up to 1.5 m/s by 0.06 J; beyond that it never grows (impulses along predicted
// directions take some).
TEST_P(Joints, AFourBarLinkageStaysClosed) {
  constexpr double kTolerance = 1e-4;
  ParticleTopology particles;
  particles.positions_m = {{0, 0, 0},      {0, 0.25, 0}, {0, 0.25, 0}, {0.75, 0.5, 0},
                           {0.75, 0.5, 0}, {0.75, 0, 0}, {0.75, 0, 0}};
  particles.masses_kg = {1, 0.1, 0.1, 0.2, 0.2, 0.1, 1};
  particles.distance_constraints = {
      {0, 1, 0.25, 0}, {2, 3, std::hypot(0.75, 0.25), 0}, {4, 5, 0.5, 0}};
  particles.point_joints = {{1, 2, 0}, {3, 4, 0}, {5, 6, 0}};
  Scene scene = Particles(particles, {0, 6});
  scene.state.velocities_m_per_s[1] = scene.state.velocities_m_per_s[2] = {1, 0, 0};
  scene.parameters.settings = SingleSubstep(1.0 / 60, 10000);
  scene.parameters.settings.substeps = 10;
  scene.parameters.settings.tolerance = kTolerance;
  const ClothHandle cloth = Make(scene);
  const double length_scale = scene.model->length_scale_m();
  const double longest = std::hypot(0.75, 0.25);
  double first_energy = 0;
  for (int step = 0; step < 90; ++step) {
    const StepReport report = StepAlone(backend(), cloth, scene, 1, true);
    ASSERT_TRUE(report.converged);
    const ParticleState state = ReadState(backend(), cloth);
    const double slack = 16 * round_off();
    for (const auto& [i, j, compliance] : scene.model->joints()) {
      EXPECT_LE((state.positions_m[i] - state.positions_m[j]).norm(),
                kTolerance * length_scale + slack);
    }
    EXPECT_LE(report.measured.max_strain, kTolerance + 4 * slack);
    EXPECT_LE(report.measured.max_residual_m, kTolerance * longest + slack);
    const double energy = report.measured.kinetic_energy_j + report.measured.potential_energy_j;
    if (step == 0) first_energy = energy;
    EXPECT_LE(energy, first_energy + 0.06);
  }
  const Vector3d crank = ReadState(backend(), cloth).positions_m[1];
  EXPECT_GT((crank - scene.state.positions_m[1]).norm(), 0.05) << "it has moved";
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Joints);

}  // namespace
}  // namespace drape::test
