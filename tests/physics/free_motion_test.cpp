// Free motion: a spinning polygon against its closed form, and the momentum, angular momentum and
// energy of a free chain and a free cloth.
#include <algorithm>
#include <numbers>

#include "tests/physics/preset_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

struct Motion {
  Vector3d momentum = Vector3d::Zero();
  Vector3d angular_momentum = Vector3d::Zero();  // about the origin
  double kinetic_energy_j = 0;
};

Motion MotionOf(const SceneModel& model, const ParticleState& state) {
  Motion motion;
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    const double mass = model.masses_kg()[i];
    const Vector3d& p = state.positions_m[i];
    const Vector3d& v = state.velocities_m_per_s[i];
    motion.momentum += mass * v;
    motion.angular_momentum += mass * p.cross(v);
    motion.kinetic_energy_j += mass * v.squaredNorm() / 2;
  }
  return motion;
}

class FreeMotion : public PresetTest {
 protected:
  // The scene over one second at h, h/2, h/4.
  std::array<ParticleState, 3> Refined(Scene scene, uint32_t substeps, uint32_t sweeps) {
    std::array<ParticleState, 3> states;
    for (ParticleState& state : states) {
      scene.parameters.settings = SchemeSettings(preset(), 1, substeps, sweeps);
      state = StateAfter(scene);
      substeps *= 2;
    }
    return states;
  }

  // Rounding of a sum of terms of this size: each substep rounds a position twice and a velocity 4
  // times in each of up to 4 constraints. Equal substeps may round in the same way and add up; the
  // sweeps of one substep round different numbers and add up as the root of their count.
  double Rounding(uint32_t substeps, uint32_t sweeps, double size) {
    return (2 + 4.0 * 4 * std::sqrt(sweeps)) * substeps * round_off() * size;
  }

  void ExpectKept(const Scene& scene, const std::array<ParticleState, 3>& states,
                  double rounding_share) {
    const Motion before = MotionOf(*scene.model, scene.state);
    std::array<Motion, 3> after;
    for (size_t k = 0; k < 3; ++k) after[k] = MotionOf(*scene.model, states[k]);
    for (int axis = 0; axis < 3; ++axis) {
      std::array<double, 3> spins{};
      for (size_t k = 0; k < 3; ++k) {
        spins[k] = after[k].angular_momentum[axis];
        EXPECT_NEAR(after[k].momentum[axis], before.momentum[axis],
                    rounding_share * (1 + before.momentum.norm()));
      }
      ExpectLimit(spins, order(), before.angular_momentum[axis],
                  rounding_share * before.angular_momentum.norm(), "angular momentum");
    }
    std::array<double, 3> energies{};
    for (size_t k = 0; k < 3; ++k) energies[k] = after[k].kinetic_energy_j;
    ExpectLimit(energies, order(), before.kinetic_energy_j,
                2 * rounding_share * before.kinetic_energy_j, "kinetic energy");
  }
};

// A ring of N masses that turns at w: each side pulls with T = m w^2 R / (2 sin(pi/N)). The sides
// are compliant, so that T can be read from their elongation alpha T, and start with it. Sides so
// stiff that their own oscillation, which would not be smooth in h, is gone after a second (the
// implicit treatment of compliance damps it by w_s^2 h / 2 > 10^3/s).
TEST_P(FreeMotion, ASpinningPolygonIsHeldByItsTension) {
  constexpr uint32_t kCount = 8;
  constexpr double kMass_kg = 0.1, kRadius_m = 0.5, kRate = 6, kCompliance_m_per_n = 1e-5;
  const double half = std::sin(std::numbers::pi / kCount);
  const double side = 2 * kRadius_m * half;
  const double tension = kMass_kg * kRate * kRate * kRadius_m / (2 * half);
  ParticleTopology ring;
  for (uint32_t k = 0; k < kCount; ++k) {
    const double angle = 2 * std::numbers::pi * k / kCount;
    ring.positions_m.emplace_back(kRadius_m * std::cos(angle), kRadius_m * std::sin(angle), 0);
    ring.masses_kg.push_back(kMass_kg);
    ring.distance_constraints.push_back(
        {k, (k + 1) % kCount, side - kCompliance_m_per_n * tension, kCompliance_m_per_n});
  }
  Scene scene = Particles(ring);
  scene.parameters.gravity_m_per_s2.setZero();
  for (uint32_t k = 0; k < kCount; ++k) {
    scene.state.velocities_m_per_s[k] = kRate * Vector3d::UnitZ().cross(scene.state.positions_m[k]);
  }
  constexpr uint32_t kSubsteps = 120, kSweeps = 40;
  const auto states = Refined(scene, kSubsteps, kSweeps);
  // The oscillation of the sides is not resolved: within the first substeps their elastic energy, N
  // alpha T^2 / 2, may become motion, the same at any of these steps.
  const double elastic_share = kCount * kCompliance_m_per_n * tension * tension / 2 /
                               MotionOf(*scene.model, scene.state).kinetic_energy_j;
  const double rounding = Rounding(4 * kSubsteps, kSweeps, 1) + elastic_share;
  std::array<double, 3> pulls{};
  for (size_t k = 0; k < 3; ++k) {
    for (const DistanceConstraint& c : scene.model->constraints()) {
      const Vector3d d = states[k].positions_m[c.j] - states[k].positions_m[c.i];
      pulls[k] += (d.norm() - c.rest_length_m) / c.compliance_m_per_n / kCount;
    }
  }
  // Elongations are resolved to the rounding of the positions.
  ExpectLimit(pulls, order(), tension,
              rounding * tension + 4 * kRadius_m * round_off() / kCompliance_m_per_n, "tension");
  ExpectKept(scene, states, rounding);
}

// Eight links of unequal masses thrown as a whole: spinning, drifting and bending.
TEST_P(FreeMotion, AFreeChainKeepsMomentumAngularMomentumAndEnergy) {
  ParticleTopology chain;
  for (uint32_t k = 0; k <= 8; ++k) {
    chain.positions_m.emplace_back(0.1 * k - 0.4, 0, 0);
    chain.masses_kg.push_back(0.05 * (1 + k % 3));
    if (k > 0) chain.distance_constraints.push_back({k - 1, k, 0.1, 0});
  }
  Scene scene = Particles(chain);
  scene.parameters.gravity_m_per_s2.setZero();
  for (uint32_t k = 0; k <= 8; ++k) {
    // Across the links only, so that none is asked to stretch at the start.
    const double x = scene.state.positions_m[k].x();
    scene.state.velocities_m_per_s[k] = Vector3d(0.2, 4 * x + 2 * x * x, 1 - 3 * x * x);
  }
  constexpr uint32_t kSubsteps = 120, kSweeps = 40;
  ExpectKept(scene, Refined(scene, kSubsteps, kSweeps), Rounding(4 * kSubsteps, kSweeps, 1));
}

// A free sheet, waving and spinning about its normal at rest.
TEST_P(FreeMotion, AFreeClothKeepsMomentumAngularMomentumAndEnergy) {
  Scene scene = Grid(4, 4, 0.3, 0.3);
  scene.parameters.gravity_m_per_s2.setZero();
  for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
    const Vector3d p = scene.state.positions_m[i] - Vector3d(0.15, 0, 0.15);
    scene.state.velocities_m_per_s[i] =
        Vector3d(0, 0.3, 0.1) + Vector3d(0, 2, 0).cross(p) +
        Vector3d(0, std::sin(8 * p.x() + 0.4) * std::cos(6 * p.z()), 0);
  }
  constexpr uint32_t kSubsteps = 120, kSweeps = 40;
  ExpectKept(scene, Refined(scene, kSubsteps, kSweeps), Rounding(4 * kSubsteps, kSweeps, 1));
}

DRAPE_PRESET_TEST_ON_EVERY_BACKEND(FreeMotion);

}  // namespace
}  // namespace drape::test
