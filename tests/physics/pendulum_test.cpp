// The pendulum at 2 rad and the spherical pendulum, every preset on every backend.
#include <algorithm>

#include "tests/physics/preset_test.h"
#include "tests/support/closed_forms.h"
#include "tests/support/planar_chain.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
constexpr double kG = 9.81;
constexpr double kLength_m = 1;
constexpr double kAngle_rad = 2;
constexpr std::array<uint32_t, 3> kSubsteps = {240, 480, 960};

Scene PendulumScene(const StepSettings& settings) {
  Scene scene = Chain(1, kLength_m, 0.2);
  scene.state.positions_m[1] = kLength_m * Vector3d(std::sin(kAngle_rad), -std::cos(kAngle_rad), 0);
  scene.parameters.settings = settings;
  return scene;
}

double AngleOf(const ParticleState& state) {
  return std::atan2(state.positions_m[1].x(), -state.positions_m[1].y());
}

// Each substep rounds the position of the bob twice and its velocity some 4 times, whose error acts
// for the rest of the time (worth 4 more of the position: within a period the bob travels a few
// lengths).
double PendulumRounding(uint32_t substeps, double round_off) {
  return 6.0 * substeps * round_off * kAngle_rad;
}

class Pendulum : public PresetTest {
 protected:
  double Rounding(uint32_t substeps) { return PendulumRounding(substeps, round_off()); }
};

class EndDirection : public PhysicsTest {};

// After a quarter of T = 2 pi sqrt(L/g) / AGM(1, cos(angle/2)) it passes the bottom, after a half
// it is on the other side, after the whole back. Between those the exact chain of one link gives
// the position, without the AGM (planar_chain_test.cpp compares the two).
TEST_P(Pendulum, At2RadiansKeepsTheExactTimes) {
  const double period = PendulumPeriod_s(kLength_m, kG, kAngle_rad);
  for (const double share : {0.25, 0.3, 0.5, 1.0}) {
    SCOPED_TRACE("after " + std::to_string(share) + " periods");
    PlanarChain exact = StraightChain(1, kLength_m, 1, kAngle_rad);
    exact.AdvanceConverged(share * period, 1e-12);
    std::array<double, 3> angles{}, errors{};
    for (size_t k = 0; k < 3; ++k) {
      const StepSettings settings = SchemeSettings(preset(), share * period, kSubsteps[k], 4);
      angles[k] = AngleOf(StateAfter(PendulumScene(settings)));
      errors[k] = std::abs(angles[k] - exact.links()[0].angle_rad);
    }
    ExpectOrder(errors, order(), Rounding(kSubsteps[2]));
    ExpectLimit(angles, order(), exact.links()[0].angle_rad, Rounding(kSubsteps[2]), "angle");
  }
}

// Impulses along the END of the substep damp each link by h times its tension: from the step of the
// angle d' = atan((sin d - w2 sin t) / (2 - cos d + w2 cos t)), w2 = h^2 g / L, to first order in h
//   t'' = -(g/L) sin t - h t' (t'^2 + (g/L) cos t),   m L (t'^2 + (g/L) cos t) the tension.
// So the first order error is known, and what is left beside this equation is of second order.
// PAPER has this scheme.
TEST_P(EndDirection, DampsAPendulumByItsTension) {
  const double duration = PendulumPeriod_s(kLength_m, kG, kAngle_rad);
  std::array<double, 3> errors{};
  for (size_t k = 0; k < 3; ++k) {
    const double h = duration / kSubsteps[k];
    const auto acceleration = [&](double t, double w) {
      return -kG / kLength_m * std::sin(t) - h * w * (w * w + kG / kLength_m * std::cos(t));
    };
    double t = kAngle_rad, w = 0;
    const uint32_t steps = 20000;
    const double dt = duration / steps;
    for (uint32_t step = 0; step < steps; ++step) {  // midpoint rule: an error of 1e-6 here
      const double t_half = t + dt / 2 * w, w_half = w + dt / 2 * acceleration(t, w);
      t += dt * w_half;
      w += dt * acceleration(t_half, w_half);
    }
    const StepSettings settings =
        SchemeSettings(Preset::kPaper, duration, kSubsteps[k], /*sweeps=*/4);
    errors[k] = std::abs(AngleOf(StateAfter(PendulumScene(settings))) - t);
  }
  ExpectOrder(errors, 2, PendulumRounding(kSubsteps[2], round_off()) + 1e-6);
}

// Released horizontally, sideways: the height z below the pivot obeys 2 (E + g z)(l^2 - z^2) = L^2
// with E and L of the start, a cubic of which the start is one root. The next root is the turning
// point. Sampled every 1/240 s; the height about an extremum is a parabola up to a share (w dt)^2 /
// 12 of its change within dt, some 1e-7 m.
TEST_P(Pendulum, TheSphericalPendulumTurnsAtTheRootsOfTheCubic) {
  constexpr double kDepth_m = 0.5, kSpeed_m_per_s = 1.5, kSample_s = 1.0 / 240;
  const double radius = std::sqrt(kLength_m * kLength_m - kDepth_m * kDepth_m);
  const double energy = kSpeed_m_per_s * kSpeed_m_per_s / 2 - kG * kDepth_m;
  const double b = energy / kG + kDepth_m;
  const double lowest = (-b + std::sqrt(b * b + 4 * (kLength_m * kLength_m - b * kDepth_m))) / 2;
  std::array<double, 3> lowest_seen{}, momentum{}, energies{};
  for (size_t k = 0; k < 3; ++k) {
    Scene scene = Chain(1, kLength_m, 0.2);
    scene.state.positions_m[1] = Vector3d(radius, -kDepth_m, 0);
    scene.state.velocities_m_per_s[1] = Vector3d(0, 0, kSpeed_m_per_s);
    scene.parameters.settings = SchemeSettings(preset(), kSample_s, 2u << k, 4);
    const ClothHandle cloth = Make(scene);
    std::array<double, 3> depth = {0, 0, kDepth_m};  // the last three samples
    while (!(depth[0] < depth[1] && depth[1] > depth[2])) {
      StepAlone(backend(), cloth, scene);
      const ParticleState state = ReadState(backend(), cloth);
      const Vector3d p = state.positions_m[1], v = state.velocities_m_per_s[1];
      depth = {depth[1], depth[2], -p.y()};
      momentum[k] = p.z() * v.x() - p.x() * v.z();
      energies[k] = v.squaredNorm() / 2 + kG * p.y();
      ASSERT_LT(depth[2], 1.01);
    }
    const double slope = (depth[2] - depth[0]) / 2;
    const double curvature = depth[2] - 2 * depth[1] + depth[0];
    lowest_seen[k] = depth[1] - slope * slope / (2 * curvature);
  }
  const double rounding = Rounding(8 * 240);  // it turns within half a second
  ExpectLimit(lowest_seen, order(), lowest, rounding + 1e-7, "depth");
  ExpectLimit(momentum, order(), -radius * kSpeed_m_per_s, 4 * rounding, "angular momentum");
  ExpectLimit(energies, order(), energy, 8 * rounding, "energy");
}

DRAPE_PRESET_TEST_ON_EVERY_BACKEND(Pendulum);
DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(EndDirection);

}  // namespace
}  // namespace drape::test
