// Rest lengths as functions of time.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/physics/physics_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class DrivenLengths : public PhysicsTest {};

// A particle on a link to a pin, whose length follows a sine, without other forces: it is where the
// link ends, and as fast as the link grows in the last substep. 8 operations of 1 m, over h.
TEST_P(DrivenLengths, AParticleMovesWithItsLink) {
  Scene scene =
      Particles({{Vector3d::Zero(), Vector3d(0, 0, 1)}, {1, 0.25}, {{0, 1, 1, 0}}, {}}, {0});
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.settings = SingleSubstep(1.0 / 64);
  scene.parameters.settings.substeps = 4;
  scene.rest_length_targets_m = {1};
  const ClothHandle cloth = Make(scene);
  double before_m = 1;
  for (int step = 1; step <= 64; ++step) {
    const double length_m = 1 + 0.25 * std::sin(2 * std::numbers::pi * step / 64);
    scene.rest_length_targets_m = {length_m};
    const StepReport report = StepAlone(backend(), cloth, scene, 1, true);
    const ParticleState state = ReadState(backend(), cloth);
    const double bound = 8 * round_off() * 1.25;
    EXPECT_NEAR(state.positions_m[1].z(), length_m, bound);
    EXPECT_EQ(state.positions_m[1].head<2>(), Eigen::Vector2d::Zero());
    EXPECT_NEAR(state.velocities_m_per_s[1].z(), (length_m - before_m) * 64, bound * 64 * 4 * 2);
    EXPECT_LE(report.measured.max_strain, 2 * bound);
    before_m = length_m;
  }
}

// Without targets the lengths stay where they were driven; given up, they are the model's again.
TEST_P(DrivenLengths, StayAndAreGivenUp) {
  Scene scene =
      Particles({{Vector3d::Zero(), Vector3d(0, 0, 1)}, {1, 0.25}, {{0, 1, 1, 0}}, {}}, {0});
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.damping_per_s = 100;
  scene.parameters.settings = SingleSubstep(1.0 / 64);
  scene.rest_length_targets_m = {1.5};
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene, 2);
  const Vector3d driven = ReadState(backend(), cloth).positions_m[1];
  EXPECT_NEAR(driven.z(), 1.5, 8 * round_off() * 1.5);
  scene.rest_length_targets_m.clear();
  const StepReport stayed = StepAlone(backend(), cloth, scene, 3, true);
  EXPECT_LE(stayed.measured.max_strain, 16 * round_off());
  EXPECT_NEAR(ReadState(backend(), cloth).positions_m[1].z(), 1.5, 16 * round_off() * 1.5);
  ClothUpdate update;
  update.rest_lengths_m.emplace();
  ASSERT_TRUE(backend().Write(cloth, update).ok());
  StepAlone(backend(), cloth, scene);
  EXPECT_NEAR(ReadState(backend(), cloth).positions_m[1].z(), 1, 16 * round_off() * 1.5);
}

// m r^2 omega of a pair that spins in free space, while its link shrinks from 1 m to 1/2 m in 1/4
// s.
double AngularMomentumAfterShrinking(Backend& backend, uint32_t substeps) {
  Scene scene = Particles(
      {{Vector3d(-0.75, 0, 0), Vector3d(0.25, 0, 0)}, {0.125, 0.375}, {{0, 1, 1, 0}}, {}});
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.settings = SingleSubstep(1.0 / 64);
  scene.parameters.settings.substeps = substeps;
  scene.state.velocities_m_per_s = {{0, 0, -1.5}, {0, 0, 0.5}};
  scene.rest_length_targets_m = {1};
  const ClothHandle cloth = CreateCloth(backend, scene);
  for (int step = 1; step <= 16; ++step) {
    scene.rest_length_targets_m = {1 - step / 32.0};
    StepAlone(backend, cloth, scene);
  }
  const ParticleState state = ReadState(backend, cloth);
  backend.Destroy(cloth);
  double momentum = 0;
  for (uint32_t i = 0; i < 2; ++i) {
    momentum +=
        scene.model->masses_kg()[i] * state.positions_m[i].cross(state.velocities_m_per_s[i]).y();
  }
  return momentum;
}

// A skater who pulls the arms in: the angular momentum stays, so half the radius turns four times
// as fast. Impulses along predicted directions lose some, to first order: half as much with half
// the substep, and after extrapolation only the second order.
TEST_P(DrivenLengths, ASkaterSpeedsUp) {
  constexpr double kMomentum = -(0.125 * 0.75 * 1.5 + 0.375 * 0.25 * 0.5);
  const double coarse = AngularMomentumAfterShrinking(backend(), 32) / kMomentum;
  const double fine = AngularMomentumAfterShrinking(backend(), 64) / kMomentum;
  EXPECT_NEAR(coarse, 1, 0.03);
  const double rounding = 16 * 64 * 16 * round_off();
  EXPECT_NEAR(fine, 1, 0.6 * std::abs(coarse - 1) + rounding);
  EXPECT_NEAR(2 * fine - coarse, 1, 0.05 * std::abs(coarse - 1) + rounding);
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(DrivenLengths);

}  // namespace
}  // namespace drape::test
