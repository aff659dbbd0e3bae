// Ropes and struts: distance constraints that only pull or only push (Bender et al. 2009, section
// 3.2, inequality constraints).
#include <algorithm>
#include <cmath>

#include "tests/physics/physics_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class Inequalities : public PhysicsTest {};

// A pin in the origin and a particle of 0.5 kg.
Scene OnePair(const Vector3d& position, ConstraintKind kind, double length_m,
              double compliance_m_per_n = 0) {
  Scene scene = Particles(
      {{Vector3d::Zero(), position}, {1, 0.5}, {{0, 1, length_m, compliance_m_per_n, kind}}, {}},
      {0});
  return scene;
}

// Bit for bit the lone particle while slack, then held at its length.
TEST_P(Inequalities, ARopeFallsFreelyUntilItIsTaut) {
  const Vector3d start(0, -0.25, 0);
  Scene rope = OnePair(start, ConstraintKind::kAtMost, 1);
  Scene lone = LoneParticle(start, Vector3d::Zero());
  rope.parameters.settings = lone.parameters.settings = SingleSubstep(1.0 / 64, 3);
  const ClothHandle held = Make(rope);
  const ClothHandle free = Make(lone);
  int free_steps = 0;
  for (int step = 0; step < 64; ++step) {
    const StepReport report = StepAlone(backend(), held, rope, 1, true);
    StepAlone(backend(), free, lone);
    const Vector3d p = ReadState(backend(), held).positions_m[1];
    const Vector3d q = ReadState(backend(), free).positions_m[0];
    if (q.norm() < 1) {
      EXPECT_EQ(p, q);
      EXPECT_EQ(report.measured.max_strain, 0);
      EXPECT_EQ(report.measured.max_residual_m, 0);
      ++free_steps;
    } else {
      // 8 operations of 1 m; a velocity that hangs at rest carries the half step of gravity.
      EXPECT_LE(p.norm(), 1 + 8 * round_off());
      EXPECT_GE(p.norm(), 1 - 8 * round_off());
    }
  }
  EXPECT_EQ(free_steps, static_cast<int>(64 * std::sqrt(2 * 0.75 / 9.81)));
}

// The mirror image: falls towards the pin until the strut stops it.
TEST_P(Inequalities, AStrutPushesAndNeverPulls) {
  Scene strut = OnePair({0, 1, 0}, ConstraintKind::kAtLeast, 0.5);
  strut.parameters.settings = SingleSubstep(1.0 / 64, 3);
  const ClothHandle held = Make(strut);
  StepAlone(backend(), held, strut, 64);
  EXPECT_NEAR(ReadState(backend(), held).positions_m[1].y(), 0.5, 8 * round_off());

  Scene thrown = strut;
  thrown.state.velocities_m_per_s[1] = {0, 2, 0};
  Scene lone = LoneParticle({0, 1, 0}, {0, 2, 0});
  lone.parameters.settings = thrown.parameters.settings;
  const ClothHandle a = Make(thrown);
  const ClothHandle b = Make(lone);
  StepAlone(backend(), a, thrown, 20);
  StepAlone(backend(), b, lone, 20);
  EXPECT_EQ(ReadState(backend(), a).positions_m[1], ReadState(backend(), b).positions_m[0]);
}

// alpha m g, as an equality; and an impulse that pulled too much is taken back within the substep:
// the number of sweeps does not show.
TEST_P(Inequalities, ACompliantRopeStretchesAsItsLoadSays) {
  constexpr double kCompliance_m_per_n = 1.0 / 64;
  const double length_m = 1 + kCompliance_m_per_n * 0.5 * 9.81;
  for (const uint32_t sweeps : {1u, 2u, 10u}) {
    Scene scene = OnePair({0, -length_m, 0}, ConstraintKind::kAtMost, 1, kCompliance_m_per_n);
    scene.parameters.settings = SingleSubstep(1.0 / 64, sweeps);
    scene.state.velocities_m_per_s[1].y() = -9.81 / 128;
    const ClothHandle cloth = Make(scene);
    const StepReport report = StepAlone(backend(), cloth, scene, 20, true);
    EXPECT_NEAR(ReadState(backend(), cloth).positions_m[1].y(), -length_m,
                20 * 10 * sweeps * round_off())
        << sweeps;
    EXPECT_NEAR(report.measured.strain_energy_j, kCompliance_m_per_n * std::pow(0.5 * 9.81, 2) / 2,
                1e-4);
  }
}

// A chain of two ropes and a spacer between them: each report counts only what its kind forbids.
TEST_P(Inequalities, StrainCountsOnlyWhatIsForbidden) {
  Scene scene = Particles({{Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(2, 0, 0)},
                           {1, 1, 1},
                           {{0, 1, 1.25, 0, ConstraintKind::kAtMost},
                            {1, 2, 0.5, 0, ConstraintKind::kAtLeast},
                            {0, 2, 1.6, 0, ConstraintKind::kAtMost}},
                           {}},
                          {0, 2});
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.settings = SingleSubstep(1.0 / 64);
  const ClothHandle cloth = Make(scene);
  // Two pins keep the third rope out of the model.
  const Measurements measured = StepAlone(backend(), cloth, scene, 1, true).measured;
  EXPECT_EQ(measured.max_strain, 0);
  EXPECT_EQ(measured.rms_strain, 0);
  EXPECT_EQ(measured.max_residual_m, 0);
  EXPECT_EQ(measured.strain_energy_j, 0);
}

// Highest point of a mass on a rope of 1 m that is thrown from the bottom with v0^2 = 3.5 g l. The
// rope becomes slack at 120 degrees from the bottom (cos = (2 - v0^2 / g l) / 3), and the parabola
// from there rises by 3/16 l above 1/2 l.
double HighestPoint(Backend& backend, uint32_t substeps) {
  Scene scene = OnePair({0, -1, 0}, ConstraintKind::kAtMost, 1);
  scene.parameters.settings = SingleSubstep(1.0 / 256);
  scene.parameters.settings.substeps = substeps;
  scene.state.velocities_m_per_s[1] = {std::sqrt(3.5 * 9.81), 0, 0};
  const ClothHandle cloth = CreateCloth(backend, scene);
  double highest = -1;
  for (int step = 0; step < 256; ++step) {
    StepAlone(backend, cloth, scene);
    highest = std::max(highest, ReadState(backend, cloth).positions_m[1].y());
  }
  backend.Destroy(cloth);
  return highest;
}

// First order in the substep: the error halves with it; a step of 1/256 s misses the flat top of
// the parabola by at most g (1/512 s)^2 / 2 = 2e-5 m.
TEST_P(Inequalities, AMassOnARopeLeavesTheCircleAndFliesOn) {
  const double errors[] = {0.6875 - HighestPoint(backend(), 8),
                           0.6875 - HighestPoint(backend(), 16)};
  EXPECT_LT(std::abs(errors[0]), 0.02);
  const double rounding = 4096 * 8 * round_off();
  EXPECT_LT(std::abs(errors[1]), 0.6 * std::abs(errors[0]) + 2e-5 + rounding);
  EXPECT_LT(std::abs(2 * errors[1] - errors[0]), 0.1 * std::abs(errors[0]) + 1e-4 + rounding);
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Inequalities);

}  // namespace
}  // namespace drape::test
