// Pendulum, spring and compliant constraint against their closed forms.
#include <algorithm>
#include <cmath>
#include <functional>

#include "server/solver/force_limits.h"
#include "tests/physics/physics_test.h"
#include "tests/support/closed_forms.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
constexpr double kG = 9.81;
constexpr double kPi = 3.14159265358979323846;

class Oscillation : public PhysicsTest {
 protected:
  // Times at which `signal` of the state changes its sign, by linear interpolation between steps.
  std::vector<double> ZeroCrossings(ClothHandle cloth, const Scene& scene, size_t count,
                                    const std::function<double(const ParticleState&)>& signal) {
    std::vector<double> times;
    const double h = scene.parameters.settings.time_step_s;
    double before = signal(ReadState(backend(), cloth));
    for (uint32_t step = 0; times.size() < count && step < 100000; ++step) {
      StepAlone(backend(), cloth, scene);
      const double after = signal(ReadState(backend(), cloth));
      if (before * after < 0) times.push_back(h * (step + before / (before - after)));
      before = after;
    }
    return times;
  }
};

// T = 2 pi sqrt(L/g) / AGM(1, cos(theta/2)). With the impulse along the rod at the END of the
// substep, eliminating v gives the step of the angle d' = atan((sin d - w2 sin t) / (2 - cos d + w2
// cos t)), w2 = h^2 g / L: a damping rate of h g / L, which shortens the frequency by w2/8, and
// accelerations reduced by 1 + w2, which shortens it by w2/2; Verlet itself adds w2/24. Together
// below w2. The damping also takes a share h g/L T of the amplitude, and the period depends on it
// by theta^2/16.
TEST_P(Oscillation, PendulumPeriod) {
  constexpr double kLength = 1;
  constexpr double kAngle = 0.1;
  const double exact = PendulumPeriod_s(kLength, kG, kAngle);
  for (const double h : {1.0 / 240, 1.0 / 480}) {
    Scene scene = Chain(1, kLength, 0.2);
    scene.state.positions_m[1] = kLength * Vector3d(std::sin(kAngle), -std::cos(kAngle), 0);
    scene.parameters.settings = SingleSubstep(h, 4);
    const auto crossings = ZeroCrossings(
        Make(scene), scene, 2, [](const ParticleState& state) { return state.positions_m[1].x(); });
    ASSERT_EQ(crossings.size(), 2u);
    const double w2 = h * h * kG / kLength;
    const double discretisation = exact * (w2 + kAngle * kAngle / 16 * h * kG / kLength * exact);
    // Each substep rounds a position of 1 m twice; the bob passes the middle at theta sqrt(g L).
    const double rounding =
        2 * exact / h * round_off() * kLength / (kAngle * std::sqrt(kG * kLength));
    EXPECT_NEAR(2 * (crossings[1] - crossings[0]), exact, discretisation + rounding) << "h " << h;
  }
}

// Two masses on a spring of rest length 0, along x.
Scene SpringPair(double m1, double m2, double stiffness, SpringIntegration integration, double h) {
  ParticleTopology pair;
  pair.positions_m = {Vector3d(0, 0, 0), Vector3d(0.5, 0, 0)};
  pair.masses_kg = {m1, m2};
  pair.springs = {{.i = 0, .j = 1, .rest_length_m = 0, .stiffness_n_per_m = stiffness}};
  Scene scene = Particles(pair);
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.settings = SingleSubstep(h);
  scene.parameters.settings.spring_integration = integration;
  return scene;
}

double Extension(const ParticleState& state) {
  return state.positions_m[1].x() - state.positions_m[0].x();
}

// T = 2 pi sqrt(m_red / k). Velocity Verlet has sin(w' h/2) = w h/2, so a period shorter by w^2
// h^2/24; the interpolation of a sine between samples shifts a crossing by at most h (w h)^2 / 16.
TEST_P(Oscillation, SpringPeriodWithHalfKicks) {
  const double reduced_mass = 0.1 * 0.3 / (0.1 + 0.3);
  constexpr double kStiffness = 30;
  const double omega = std::sqrt(kStiffness / reduced_mass);
  const double exact = 2 * kPi / omega;
  const double h = exact / 60;
  const Scene scene = SpringPair(0.1, 0.3, kStiffness, SpringIntegration::kHalfKicks, h);
  constexpr size_t kHalfPeriods = 20;
  const auto crossings = ZeroCrossings(Make(scene), scene, kHalfPeriods + 1, Extension);
  ASSERT_EQ(crossings.size(), kHalfPeriods + 1);
  const double measured = 2 * (crossings.back() - crossings.front()) / kHalfPeriods;
  const double wh_sq = omega * h * omega * h;
  // Higher orders of the asin are below a tenth of the first; rounding as above.
  const double bound = 1.1 * exact * wh_sq / 24 + 2 * 2 * h * wh_sq / 16 / kHalfPeriods +
                       60 * kHalfPeriods * 4 * round_off() * exact;
  EXPECT_NEAR(measured, exact, bound);
  EXPECT_LT(measured, exact) << "Verlet is too fast, never too slow";
}

// Samples of the exact solution of the Verlet recurrence: x(n+1) + x(n-1) = (2 - w^2 h^2) x(n),
// without end.
TEST_P(Oscillation, HalfKicksObeyTheVerletRecurrenceAndKeepTheAmplitude) {
  const double omega = std::sqrt(30 / 0.075);
  const double h = 0.3 / omega;
  const Scene scene = SpringPair(0.1, 0.3, 30, SpringIntegration::kHalfKicks, h);
  const ClothHandle cloth = Make(scene);
  double before = Extension(scene.state);
  StepAlone(backend(), cloth, scene);
  double now = Extension(ReadState(backend(), cloth));
  double largest = 0;
  for (int step = 0; step < 500; ++step) {
    StepAlone(backend(), cloth, scene);
    const double after = Extension(ReadState(backend(), cloth));
    // There are some 30 operations on numbers below 0.5 m (positions) between three samples.
    EXPECT_NEAR(after + before, (2 - 0.09) * now, 30 * round_off() * 0.5) << step;
    largest = std::max(largest, std::abs(after));
    before = std::exchange(now, after);
  }
  // The samples are on a sine of amplitude 0.5 / cos(phase of the first) = 0.5; rounding walks.
  EXPECT_LE(largest, 0.5 * (1 + 500 * 30 * round_off()));
  EXPECT_GE(largest, 0.5 * std::cos(0.3)) << "some sample is within a step of the maximum";
}

// Forces held constant over the substep (Bender et al. 2009, equations 1 and 2): the step matrix
// has the determinant D = 1 + h^2 w^2 / 2, so x(n)^2 - x(n+1) x(n-1) grows by D each step.
TEST_P(Oscillation, InForceSpringsGainTheKnownAmount) {
  const double omega = std::sqrt(30 / 0.075);
  const double h = 0.3 / omega;
  const Scene scene = SpringPair(0.1, 0.3, 30, SpringIntegration::kInForce, h);
  const ClothHandle cloth = Make(scene);
  std::vector<double> x = {Extension(scene.state)};
  constexpr size_t kSteps = 30;
  for (size_t step = 0; step < kSteps; ++step) {
    StepAlone(backend(), cloth, scene);
    x.push_back(Extension(ReadState(backend(), cloth)));
  }
  const double first = x[1] * x[1] - x[0] * x[2];
  const double last = x[kSteps - 1] * x[kSteps - 1] - x[kSteps] * x[kSteps - 2];
  const double growth = std::pow(1 + 0.09 / 2, static_cast<double>(kSteps) - 2);
  // W is about (0.3 x)^2: a relative error of x counts 2 / 0.09 times; 10 roundings per step add
  // up.
  EXPECT_NEAR(last / first, growth, growth * 2 / 0.09 * 10 * kSteps * round_off());
}

// The warning uses the rate of the pair, whose frequency bound is exact for equal masses: with the
// spring's damping s, D = 1 + h^2 w^2 / 2 - h s w^2, and exp(-c h) for the cloth's.
TEST_P(Oscillation, TheReportWarnsOfSpringsThatGainEnergy) {
  const double omega = std::sqrt(30 / 0.1);
  const double h = 0.3 / omega;
  for (const double damping_s : {0.0, 0.3 * h, 0.6 * h}) {
    for (const double damping_per_s : {0.0, 4.0}) {
      ParticleTopology pair;
      pair.positions_m = {{0, 0, 0}, {0.5, 0, 0}};
      pair.masses_kg = {0.2, 0.2};
      pair.springs = {{0, 1, 0, 30, 30 * damping_s}};
      Scene scene = Particles(pair);
      scene.parameters.gravity_m_per_s2.setZero();
      scene.parameters.settings = SingleSubstep(h);
      scene.parameters.settings.spring_integration = SpringIntegration::kInForce;
      scene.parameters.damping_per_s = damping_per_s;
      const double growth = std::max(0.09 * (0.5 - damping_s / h), 0.0);
      const double expected = std::log1p(growth) / h - damping_per_s;
      const double rate = SpringGain_per_s(*scene.model, scene.parameters);
      EXPECT_NEAR(rate, expected, 1e-9);

      const ClothHandle cloth = Make(scene);
      std::vector<double> x = {Extension(scene.state)};
      bool has_warned = false;
      constexpr size_t kSteps = 30;
      for (size_t step = 0; step < kSteps; ++step) {
        has_warned = StepAlone(backend(), cloth, scene).warnings.springs_gain_energy;
        x.push_back(Extension(ReadState(backend(), cloth)));
      }
      EXPECT_EQ(has_warned, rate > kMaxSpringGain_per_s) << rate;
      if (growth == 0) continue;
      const double first = x[1] * x[1] - x[0] * x[2];
      const double last = x[kSteps - 1] * x[kSteps - 1] - x[kSteps] * x[kSteps - 2];
      const double measured = std::log(last / first) / (h * (kSteps - 2));
      // The bound of the test above, as a rate.
      EXPECT_NEAR(measured, rate, 2 / 0.09 * 10 * kSteps * round_off() / (h * (kSteps - 2)));

      scene.parameters.settings.spring_integration = SpringIntegration::kHalfKicks;
      EXPECT_FALSE(PlanOf(scene).known_warnings.springs_gain_energy);
    }
  }
}

// At rest the elongation is alpha m g for any number of sweeps: the accumulated impulse makes it
// so. A compliant constraint behaves as implicit Euler does: its oscillation decays at w^2 h / 2
// = 8.3/s.
TEST_P(Oscillation, StaticElongationDoesNotDependOnTheSweeps) {
  constexpr double kMass = 0.1;
  constexpr double kCompliance = 0.01;
  const double exact = kCompliance * kMass * kG;
  for (const uint32_t sweeps : {1u, 2u, 10u, 50u}) {
    ParticleTopology hanging;
    hanging.positions_m = {Vector3d::Zero(), Vector3d(0, -1, 0)};
    hanging.masses_kg = {1, kMass};
    hanging.distance_constraints = {
        {.i = 0, .j = 1, .rest_length_m = 1, .compliance_m_per_n = kCompliance}};
    Scene scene = Particles(hanging, {0});
    scene.parameters.settings = SingleSubstep(1.0 / 60, sweeps);
    const ClothHandle cloth = Make(scene);
    const StepReport report = StepAlone(backend(), cloth, scene, 300, true);
    const double elongation = -ReadState(backend(), cloth).positions_m[1].y() - 1;
    // After 5 s exp(-41) of the first 9.81 mm is left. A position near 1 m is stored to round_off,
    // and the error of a length is made of 4 more roundings of that size.
    EXPECT_NEAR(elongation, exact, 5 * round_off() + exact * 1e-17) << sweeps << " sweeps";
    EXPECT_NEAR(report.measured.strain_energy_j, exact * exact / (2 * kCompliance),
                exact / kCompliance * 6 * round_off());
  }
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Oscillation);

}  // namespace
}  // namespace drape::test
