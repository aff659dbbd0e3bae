// Bender et al. 2009, section 3.1: equations 1 and 2 are exact for constant forces, at any step
// size.
#include <cmath>

#include "tests/physics/physics_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

// Signs such that nothing cancels: an ulp of the result is then an ulp of every term.
const Vector3d kStart(0.5, -0.25, 2);
const Vector3d kVelocity(1.1, -0.3, 0.7);
const Vector3d kGravity(0.3, -9.81, 0.2);
constexpr double kTimeSteps_s[] = {1e-4, 1e-3, 1.0 / 240, 1.0 / 60, 0.1, 1.0};

class FreeFall : public PhysicsTest {
 protected:
  void ExpectWithinUlps(const Vector3d& actual, const Vector3d& expected, double ulps,
                        const std::string& what) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_LE(UlpsBetween(scalar(), actual[axis], expected[axis]), ulps)
          << what << ", axis " << axis << ": " << actual[axis] << " for " << expected[axis];
    }
  }
};

// 8 ulp: velocity, gravity and step are rounded on the way in (half an ulp of each term), the
// products, sums and the halving add less than half an ulp each.
TEST_P(FreeFall, OneStepIsExactToRoundOffAtAnyStepSize) {
  for (const double h : kTimeSteps_s) {
    Scene scene = LoneParticle(kStart, kVelocity);
    scene.parameters.gravity_m_per_s2 = kGravity;
    scene.parameters.settings = SingleSubstep(h);
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene);
    const ParticleState state = ReadState(backend(), cloth);
    const std::string what = "h = " + std::to_string(h);
    ExpectWithinUlps(state.positions_m[0], kStart + kVelocity * h + kGravity * (h * h / 2), 8,
                     what);
    ExpectWithinUlps(state.velocities_m_per_s[0], kVelocity + kGravity * h, 8, what);
  }
}

// A sheet whose edges (1/4 m) and corners have no rounding: its constraints find no error and must
// leave it alone.
TEST_P(FreeFall, OneStepOfASheetIsExactToRoundOffAtAnyStepSize) {
  for (const double h : kTimeSteps_s) {
    Scene scene = Grid(5, 3, 1.0, 0.5);
    scene.state.velocities_m_per_s.assign(15, kVelocity);
    scene.parameters.gravity_m_per_s2 = kGravity;
    scene.parameters.settings = SingleSubstep(h, 5);
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene);
    const ParticleState state = ReadState(backend(), cloth);
    for (size_t i = 0; i < 15; ++i) {
      ExpectWithinUlps(state.positions_m[i],
                       scene.state.positions_m[i] + kVelocity * h + kGravity * (h * h / 2), 8,
                       "h = " + std::to_string(h));
      ExpectWithinUlps(state.velocities_m_per_s[i], kVelocity + kGravity * h, 8,
                       "h = " + std::to_string(h));
    }
  }
}

// n substeps: each makes at most 4 rounded operations on the velocity, whose error then acts on the
// position for the rest of the time T, and 2 on the position. Inputs add 3 roundings once.
TEST_P(FreeFall, ManyStepsAddUpOnlyRoundOff) {
  struct Case {
    double time_step_s;
    uint32_t substeps;
    uint32_t steps;
  };
  for (const auto& [time_step_s, substeps, steps] :
       {Case{1e-4, 1, 2000}, Case{1.0 / 60, 60, 60}, Case{1.0 / 60, 7, 60}, Case{1.0, 4, 5}}) {
    Scene scene = LoneParticle(kStart, kVelocity);
    scene.parameters.gravity_m_per_s2 = kGravity;
    scene.parameters.settings = SingleSubstep(time_step_s);
    scene.parameters.settings.substeps = substeps;
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene, steps);
    const ParticleState state = ReadState(backend(), cloth);

    const double n = static_cast<double>(substeps) * steps;
    const double T = time_step_s * steps;
    const Vector3d p = kStart + kVelocity * T + kGravity * (T * T / 2);
    const Vector3d v = kVelocity + kGravity * T;
    const Vector3d v_bound = (4 * n + 3) * round_off() * v.cwiseAbs();
    const Vector3d p_bound = (2 * n + 3) * round_off() * p.cwiseAbs() + T * v_bound;
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(state.velocities_m_per_s[0][axis], v[axis], v_bound[axis]) << n << " substeps";
      EXPECT_NEAR(state.positions_m[0][axis], p[axis], p_bound[axis]) << n << " substeps";
    }
  }
}

// With a tolerance no impulse acts while rounding stays below it, so a whole sheet falls as one
// particle does: the shape is kept to the rounding of its positions.
TEST_P(FreeFall, ASheetWithAToleranceKeepsItsShape) {
  Scene scene = Grid(5, 3, 1.0, 0.5);
  scene.parameters.settings = SingleSubstep(1.0 / 120, 10);
  scene.parameters.settings.tolerance = 1e-3;
  const ClothHandle cloth = Make(scene);
  const StepReport report = StepAlone(backend(), cloth, scene, 120);
  EXPECT_TRUE(report.converged);
  EXPECT_EQ(report.iterations, 1u);
  const ParticleState state = ReadState(backend(), cloth);
  const double drop = -9.81 / 2;
  const double bound = (2 * 120 + 3 + 4 * 120 + 3) * round_off() * 2 * std::abs(drop);
  for (size_t i = 0; i < 15; ++i) {
    EXPECT_NEAR(state.positions_m[i].y(), drop, bound);
    EXPECT_EQ(state.positions_m[i].x(), scene.state.positions_m[i].x());
    EXPECT_EQ(state.positions_m[i].z(), scene.state.positions_m[i].z());
  }
}

// v decays by exp(-c h) per substep, whatever the substep.
TEST_P(FreeFall, DampingIsExponential) {
  for (const uint32_t substeps : {1u, 10u, 60u}) {
    Scene scene = LoneParticle(kStart, kVelocity);
    scene.parameters.gravity_m_per_s2.setZero();
    scene.parameters.damping_per_s = 3;
    scene.parameters.settings = SingleSubstep(0.5);
    scene.parameters.settings.substeps = substeps;
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene);
    const Vector3d v = ReadState(backend(), cloth).velocities_m_per_s[0];
    // The factor of a substep is rounded (2 roundings) and applied `substeps` times (1 more).
    const double bound = 4 * substeps * round_off();
    EXPECT_LE((v - kVelocity * std::exp(-1.5)).norm(), bound * kVelocity.norm()) << substeps;
  }
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(FreeFall);

}  // namespace
}  // namespace drape::test
