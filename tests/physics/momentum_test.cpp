// Impulses enter their two particles with opposite signs: without pins and forces from outside, the
// linear momentum is kept to round-off (Bender et al. 2009, section 3.2).
#include <algorithm>

#include "tests/physics/physics_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class Momentum : public PhysicsTest {};

Vector3d MomentumOf(const SceneModel& model, const ParticleState& state) {
  Vector3d momentum = Vector3d::Zero();
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    momentum += model.masses_kg()[i] * state.velocities_m_per_s[i];
  }
  return momentum;
}

// A net of unequal masses, stretched by a tenth, spinning and drifting.
Scene SpinningNet(bool has_springs) {
  constexpr uint32_t kSide = 6;
  constexpr double kCord_m = 0.1;
  ParticleTopology net;
  for (uint32_t i = 0; i < kSide * kSide; ++i) {
    net.positions_m.emplace_back(kCord_m * (i % kSide), 0, kCord_m * (i / kSide));
    net.masses_kg.push_back(0.01 * (1 + i % 5));
    if (i % kSide > 0) net.distance_constraints.push_back({i - 1, i, kCord_m, 1e-5 * (i % 2)});
    if (i >= kSide) net.distance_constraints.push_back({i, i - kSide, kCord_m, 0});
    if (has_springs && i % kSide > 0 && i >= kSide) {
      net.springs.push_back({i, i - kSide - 1, kCord_m, 20, 0.01});
    }
  }
  Scene scene = Particles(net);
  for (uint32_t i = 0; i < kSide * kSide; ++i) {
    Vector3d& p = scene.state.positions_m[i];
    p *= 1.1;
    scene.state.velocities_m_per_s[i] =
        Vector3d(0.3, -0.2, 0.1) + Vector3d(1, 4, -2).cross(p - Vector3d(0.2, 0, 0.2));
  }
  scene.parameters.gravity_m_per_s2.setZero();
  return scene;
}

TEST_P(Momentum, IsKeptToRoundOffWithoutPins) {
  constexpr uint32_t kSteps = 20;
  constexpr uint32_t kSubsteps = 4;
  constexpr uint32_t kSweeps = 3;
  for (const bool has_springs : {false, true}) {
    Scene scene = SpinningNet(has_springs);
    scene.parameters.settings = SingleSubstep(1.0 / 60, kSweeps);
    scene.parameters.settings.substeps = kSubsteps;
    const ClothHandle cloth = Make(scene);
    // Every impulse is the same number for both particles. Rounded are 1/m, its product with the
    // impulse and the direction, and the sum: 4 roundings of a velocity change no larger than
    // removing the whole stretch of 1 cm within a substep, or of a velocity.
    double largest_velocity = 0.01 / scene.parameters.settings.substep_s();
    for (const Vector3d& v : scene.state.velocities_m_per_s) {
      largest_velocity = std::max(largest_velocity, v.norm());
    }
    double total_mass = 0;
    for (const double mass : scene.model->masses_kg()) total_mass += mass;
    // At most 4 cords and 2 springs touch a particle; the first advance and the kicks count as one
    // more.
    const double roundings = 4.0 * kSteps * kSubsteps * (4 * kSweeps + 2 + 1);
    const double bound = roundings * round_off() * total_mass * largest_velocity;

    StepAlone(backend(), cloth, scene, kSteps);
    const ParticleState state = ReadState(backend(), cloth);
    const Vector3d before = MomentumOf(*scene.model, scene.state);
    EXPECT_LE((MomentumOf(*scene.model, state) - before).norm(), bound) << before.norm();
    // The test is not empty: the net did change its shape.
    EXPECT_GT((state.velocities_m_per_s[0] - scene.state.velocities_m_per_s[0]).norm(), 0.1);
  }
}

// The centre of mass of the same net moves in a straight line.
TEST_P(Momentum, TheCentreOfMassMovesUniformly) {
  Scene scene = SpinningNet(true);
  constexpr uint32_t kSteps = 30;
  scene.parameters.settings = SingleSubstep(1.0 / 120, 5);
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene, kSteps);
  const ParticleState state = ReadState(backend(), cloth);
  Vector3d moved = Vector3d::Zero();
  double total_mass = 0;
  for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
    const double mass = scene.model->masses_kg()[i];
    moved += mass * (state.positions_m[i] - scene.state.positions_m[i]);
    total_mass += mass;
  }
  const double time = kSteps / 120.0;
  const Vector3d expected = MomentumOf(*scene.model, scene.state) * time;
  // As above, each velocity error acting for the whole time; plus 2 roundings of a position below 2
  // m per step.
  const double largest_velocity = 0.01 * 120 + 4;
  const double bound = total_mass * round_off() *
                       (4.0 * kSteps * (4 * 5 + 3) * largest_velocity * time + 2 * kSteps * 2.0);
  EXPECT_LE((moved - expected).norm(), bound);
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Momentum);

}  // namespace
}  // namespace drape::test
