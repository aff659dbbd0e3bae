// Tethers: a bound that a cloth whose constraints hold never meets, and its benefit for a cloth
// with few sweeps.
#include <algorithm>
#include <cmath>

#include "tests/physics/physics_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class Tethers : public PhysicsTest {};

// The tether of a single link is its constraint, so with it the sweep finds no stretch left: with
// and without it the substep ends with the same projection. The difference is only the rounding of
// the projections, 16 operations of size 1 m or of the speed times the time in each substep.
TEST_P(Tethers, OfASingleLinkIsItsConstraint) {
  constexpr uint32_t kSteps = 30;
  std::vector<ParticleState> states;
  for (const bool use_tethers : {false, true}) {
    Scene scene = Chain(1, 1, 0.2);
    scene.state.velocities_m_per_s[1] = Vector3d(0, 0, 0.5);
    scene.parameters.settings = SingleSubstep(1.0 / 240);
    scene.parameters.settings.use_tethers = use_tethers;
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene, kSteps);
    states.push_back(ReadState(backend(), cloth));
  }
  const double bound = 16 * kSteps * kSteps * round_off();
  EXPECT_LT((states[0].positions_m[1] - states[1].positions_m[1]).norm(), bound);
  EXPECT_GT((states[0].positions_m[1] - Vector3d(1, 0, 0)).norm(), 0.05) << "it must have moved";
}

// Their purpose: one sweep per substep carries the weight of a cloth that hangs by two corners only
// slowly to the pins. The strain without them is measured beside; theirs must be a quarter at most
// (about a tenth was seen).
TEST_P(Tethers, HoldAClothThatHangsByTwoCorners) {
  double largest[2] = {0, 0};
  double rms[2] = {0, 0};
  for (const bool use_tethers : {false, true}) {
    Scene scene = Grid(24, 24, 1, 1, {0, 23});
    scene.parameters.settings.use_tethers = use_tethers;
    scene.parameters.settings.sweep = Sweep::kColours;
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene, 60);
    for (int step = 0; step < 30; ++step) {
      const StepReport report = StepAlone(backend(), cloth, scene, 1, /*measure=*/true);
      largest[use_tethers] = std::max(largest[use_tethers], report.measured.max_strain);
      rms[use_tethers] = std::max(rms[use_tethers], report.measured.rms_strain);
    }
  }
  EXPECT_LT(largest[1], largest[0] / 4);
  EXPECT_LT(rms[1], rms[0] / 4);
  EXPECT_GT(largest[0], 0.02) << "without tethers this cloth stretches";
}

// A pin that is moved takes its tethers along.
TEST_P(Tethers, FollowTheirPins) {
  Scene scene = Grid(2, 12, 0.1, 1.1, {0});
  scene.parameters.gravity_m_per_s2.setZero();
  scene.pin_targets_m = {Vector3d(0, 0, -0.3)};
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene, 4);
  const ParticleState state = ReadState(backend(), cloth);
  const auto offsets = scene.model->tether_offsets();
  for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
    for (uint32_t t = offsets[i]; t < offsets[i + 1]; ++t) {
      const Tether& tether = scene.model->tethers()[t];
      const double distance = (state.positions_m[i] - state.positions_m[tether.pin]).norm();
      // The sweep after the tethers may stretch by a share of what they took off in this substep.
      EXPECT_LT(distance, tether.length_m * 1.02) << i;
    }
  }
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Tethers);

}  // namespace
}  // namespace drape::test
