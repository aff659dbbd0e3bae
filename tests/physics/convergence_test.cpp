// "Converged" is a promise: every error is then within the tolerance (Bender et al. 2009,
// section 3.3).
#include <algorithm>
#include <cmath>

#include "tests/physics/physics_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class Convergence : public PhysicsTest {};

// Largest |C| / rest length, recomputed from the positions that were read.
double MaxStrain(const SceneModel& model, const ParticleState& state) {
  double strain = 0;
  for (const auto& c : model.constraints()) {
    const double length = (state.positions_m[c.j] - state.positions_m[c.i]).norm();
    strain = std::max(strain, std::abs(length - c.rest_length_m) / c.rest_length_m);
  }
  return strain;
}

TEST_P(Convergence, EveryErrorIsBelowTheToleranceWhenTheReportSaysSo) {
  for (const double tolerance : {1e-2, 1e-3, 1e-4}) {
    // One pin: between two at their full distance the first row could bear no weight at all.
    Scene scene = Grid(6, 6, 0.5, 0.5, {0});
    Stir(scene, 1);
    scene.parameters.settings = SingleSubstep(1.0 / 60, 2000);
    scene.parameters.settings.substeps = 2;
    scene.parameters.settings.tolerance = tolerance;
    const ClothHandle cloth = Make(scene);
    // Positions of at most 1.5 m are rounded when they are advanced and when they are read; edges
    // are 0.1 m long.
    const double rounding = 4 * round_off() * 1.5 / 0.1;
    int converged_steps = 0;
    for (int step = 0; step < 20; ++step) {
      const StepReport report = StepAlone(backend(), cloth, scene, 1, true);
      EXPECT_EQ(report.warnings.not_converged, !report.converged);
      if (!report.converged) continue;
      ++converged_steps;
      const double strain = MaxStrain(*scene.model, ReadState(backend(), cloth));
      EXPECT_LE(strain, tolerance + rounding) << "tolerance " << tolerance << ", step " << step;
      EXPECT_NEAR(report.measured.max_strain, strain, rounding);
      EXPECT_LE(report.measured.max_residual_m, (tolerance + rounding) * 0.1);
    }
    // While it is flat it is hardly free to move in its own plane; later it converges soon.
    EXPECT_GE(converged_steps, 10) << "tolerance " << tolerance;
  }
}

TEST_P(Convergence, ContactsAreConvergedToo) {
  Scene scene = Grid(6, 6, 0.5, 0.5);
  scene.parameters.colliders = {SphereAt(Vector3d(0.25, -0.3, 0.25), 0.25),
                                PlaneThrough(Vector3d(0, -0.4, 0), Vector3d::UnitY())};
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  scene.parameters.settings = SingleSubstep(1.0 / 60, 5000);
  scene.parameters.settings.substeps = 2;
  scene.parameters.settings.tolerance = 1e-3;
  const ClothHandle cloth = Make(scene);
  uint32_t contacts = 0;
  for (int step = 0; step < 30; ++step) {
    const StepReport report = StepAlone(backend(), cloth, scene, 1, true);
    if (!report.converged) continue;
    contacts += report.measured.contacts;
    // Left alone are contact errors up to the tolerance times the mean edge, 0.1 m.
    const double bound = 1e-3 * 0.1 + 8 * round_off();
    EXPECT_LE(report.measured.max_penetration_m, bound) << "step " << step;
    EXPECT_LE(MaxStrain(*scene.model, ReadState(backend(), cloth)), 1e-3 + 40 * round_off());
  }
  EXPECT_GT(contacts, 0u) << "the sheet never touched anything";
}

TEST_P(Convergence, TooFewSweepsAreToldAndCounted) {
  Scene scene = Grid(8, 8, 0.5, 0.5, {0, 7});
  scene.parameters.settings = SingleSubstep(1.0 / 30, 2);
  scene.parameters.settings.tolerance = 1e-4;
  const ClothHandle cloth = Make(scene);
  const StepReport report = StepAlone(backend(), cloth, scene);
  EXPECT_FALSE(report.converged);
  EXPECT_TRUE(report.warnings.not_converged);
  EXPECT_EQ(report.iterations, 2u);
}

TEST_P(Convergence, WithoutAToleranceEverySweepIsDone) {
  Scene scene = Grid(3, 3, 1, 1);
  scene.parameters.settings = SingleSubstep(1.0 / 60, 3);
  scene.parameters.settings.substeps = 7;
  const ClothHandle cloth = Make(scene);
  const StepReport report = StepAlone(backend(), cloth, scene);
  EXPECT_TRUE(report.converged);
  EXPECT_FALSE(report.warnings.not_converged);
  EXPECT_EQ(report.iterations, 21u);
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Convergence);

}  // namespace
}  // namespace drape::test
