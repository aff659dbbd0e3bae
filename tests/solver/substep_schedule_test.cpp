#include "server/solver/substep_schedule.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>

#include "server/solver/solver_constants.h"

namespace drape {
namespace {

// A number and its derivative, such as the height of a particle or the error of a constraint.
struct Scalar {
  double x = 0;
  double v = 0;
};

SubstepSchedule TwoSteps(double time_step_s, uint32_t substeps) {
  StepSettings settings;
  settings.time_step_s = time_step_s;
  settings.substeps = substeps;
  return {settings, true, false};
}

// One step (server/solver/method.md, (2) and (2')) under a constant acceleration. `correct` maps
// the predicted x at the end of a substep to the one that the impulses leave.
Scalar Step(const SubstepSchedule& schedule, Scalar state, double acceleration,
            const std::function<double(double)>& correct) {
  Scalar previous = state;
  for (uint32_t index = 0; index < schedule.size(); ++index) {
    const Substep substep = schedule[index];
    const double base = state.x + (state.x - previous.x) / 3 + substep.lead_s * state.v;
    double u = state.v + (state.v - previous.v) / 3 + substep.kick_within_s * acceleration;
    const double end = correct(base + substep.interval_s * u);
    u = (end - base) / substep.interval_s;
    previous = state;
    state = {end, u};
  }
  return state;
}

double Nothing(double x) {
  return x;
}

TEST(SubstepScheduleTest, TwoStepsFallFreelyWithoutError) {
  for (const uint32_t substeps : {2u, 3u, 13u, 52u}) {
    const double t = 1.0 / 60;
    const Scalar end = Step(TwoSteps(t, substeps), {.x = 1, .v = 2}, -9.81, Nothing);
    // Rounding: x, of size 1, in each substep; Step takes u from x, which divides by H >= h/2; an
    // error of v moves x for the rest of the step.
    const double of_v = substeps * 2 * 2.3e-16 / (t / substeps / 2);
    EXPECT_NEAR(end.x, 1 + 2 * t - 9.81 * t * t / 2, of_v * t);
    EXPECT_NEAR(end.v, 2 - 9.81 * t, of_v);
  }
}

// What a step makes of (omega x, v), whose norm is the root of the energy, of an oscillator whose
// force `period` substeps share, as those of hinges do; `ratio` is its (period h omega)^2.
Eigen::Matrix2d StepOfSharedForce(uint32_t substeps, uint32_t period, double ratio) {
  StepSettings settings;
  settings.time_step_s = substeps;  // h = 1
  settings.substeps = substeps;
  const SubstepSchedule schedule(settings, true, false, period);
  const double frequency = std::sqrt(ratio) / period;
  Eigen::Matrix2d step;
  for (const int column : {0, 1}) {
    Scalar state{column == 0 ? 1 / frequency : 0, column == 1 ? 1.0 : 0.0};
    Scalar previous = state;
    double shared = 0;
    for (uint32_t index = 0; index < schedule.size(); ++index) {
      const Substep substep = schedule[index];
      const double base = state.x + (state.x - previous.x) / 3 + substep.lead_s * state.v;
      double u = state.v + (state.v - previous.v) / 3;
      if (substep.finds_hinges) {
        const double ahead_s = substep.interval_s + substep.hinge_lead_s;
        shared = -frequency * frequency * (base + ahead_s * u);
      }
      u += substep.force_s() * shared;
      previous = state;
      state = {base + substep.interval_s * u, u};
    }
    step.col(column) = Eigen::Vector2d(frequency * state.x, state.v);
  }
  return step;
}

// Forces of hinges are linear in small motions, and the frequencies of all hinges together are at
// most that of the fastest: a mesh is a set of such oscillators. None grows, and none ever has more
// than 1.05^2 of the energy that it began with.
TEST(SubstepScheduleTest, SharedForcesOfHingesGiveNoEnergy) {
  for (uint32_t substeps = 2; substeps <= 96; ++substeps) {
    for (uint32_t period = 1; period <= kMaxHingePeriod; ++period) {
      if (substeps % period != 0) continue;
      for (double ratio = kMaxSharedHingeRatio; ratio > 1e-4; ratio /= 1.05) {
        const Eigen::Matrix2d step = StepOfSharedForce(substeps, period, ratio);
        EXPECT_LE(step.eigenvalues().cwiseAbs().maxCoeff(), 1 + 1e-9)
            << substeps << " substeps, " << period << " share, " << ratio;
        Eigen::Matrix2d steps = step;
        for (int count = 1; count <= 60; ++count, steps = step * steps) {
          EXPECT_LE(steps.operatorNorm(), 1.05)
              << substeps << " substeps, " << period << " share, " << ratio;
        }
      }
    }
  }
}

// Why the period divides the substeps: where few are left over, the last force acts in them alone,
// and some frequencies below the limit grow.
TEST(SubstepScheduleTest, ForcesSharedByUnequalNumbersWouldGrow) {
  double largest = 0;
  for (double ratio = kMaxSharedHingeRatio; ratio > 1e-4; ratio /= 1.01) {
    const Eigen::Matrix2d step = StepOfSharedForce(26, 4, ratio);
    largest = std::max(largest, step.eigenvalues().cwiseAbs().maxCoeff());
  }
  EXPECT_GT(largest, 1 + 1e-3);
}

// How much an error of a compliant link and its rate can grow in a step, if one sweep finds its
// impulse but for the imaginary share `off`, as sweeps through many phases do. The link's stiffness
// times its inverse mass is `ratio`/H^2.
double GrowthOfAMissedLink(uint32_t substeps, double ratio, double off, double lead) {
  using Complex = std::complex<double>;
  StepSettings settings;
  settings.time_step_s = substeps;  // h = 1
  settings.substeps = substeps;
  const SubstepSchedule schedule(settings, true, false, 1, lead);
  const double interval_s = schedule[1].interval_s;
  const double stiffness = ratio / (interval_s * interval_s);
  Eigen::Matrix2cd step;
  for (const int column : {0, 1}) {
    Complex x = column == 0 ? 1 : 0, v = column == 1 ? 1 : 0;
    Complex previous_x = x, previous_v = v;
    for (uint32_t index = 0; index < schedule.size(); ++index) {
      const Substep substep = schedule[index];
      const Complex base = x + (x - previous_x) / 3.0 + substep.lead_s * v;
      Complex u = v + (v - previous_v) / 3.0;
      const double ahead_s = substep.link_interval_s;
      const Complex impulse =
          -(base + ahead_s * u) / (ahead_s + 1 / (stiffness * substep.force_s()));
      u += Complex(1, off) * impulse;
      previous_x = x;
      previous_v = v;
      x = base + substep.interval_s * u;
      v = u;
    }
    step.col(column) = Eigen::Vector2cd(x, v);
  }
  return step.eigenvalues().cwiseAbs().maxCoeff();
}

// What a sweep misses of an impulse is in proportion to how much the errors of links change each
// other within a substep, up to a limit. A fifth of it grows where links see errors as they will be
// at the end of the substep, and dies out where they look ahead.
TEST(SubstepScheduleTest, LinksThatLookAheadForgiveWhatASweepMisses) {
  const auto largest = [](double lead) {
    double growth = 0;
    for (const uint32_t substeps : {5u, 20u, 52u, 93u}) {
      for (double ratio = 1e-4; ratio < 1e4; ratio *= 1.2) {
        const double off = 0.2 * ratio / (1 + ratio);
        growth = std::max({growth, GrowthOfAMissedLink(substeps, ratio, off, lead),
                           GrowthOfAMissedLink(substeps, ratio, -off, lead)});
      }
    }
    return growth;
  };
  EXPECT_GT(largest(0), 1.01);
  EXPECT_LT(largest(kLinkLead), 1);
}

// A sweep leaves the share s of an error that constraints see. The error of the next substep starts
// from there, and its velocity is that of the positions. No share may make an error grow from step
// to step, whatever the number of substeps: cloths at rest would shimmer, and linkages gain energy.
// What a sweep leaves almost whole may grow by less than damping of 0.3/s takes at 60 Hz.
TEST(SubstepScheduleTest, NoErrorOfTheSweepsGrowsFromStepToStep) {
  for (const uint32_t substeps : {2u, 3u, 4u, 5u, 8u, 13u, 26u, 52u, 94u, 400u}) {
    const SubstepSchedule schedule = TwoSteps(1, substeps);
    for (int k = 0; k < 2000; ++k) {
      // Even shares, then ever closer to 1.
      const double share = k < 1000 ? k / 1000.0 : 1 - std::pow(10, -k / 333.0);
      const auto correct = [&](double error) { return share * error; };
      const Scalar of_x = Step(schedule, {.x = 1}, 0, correct);
      const Scalar of_v = Step(schedule, {.v = 1}, 0, correct);
      Eigen::Matrix2d map;
      map << of_x.x, of_v.x, of_x.v, of_v.v;
      const double growth = map.eigenvalues().cwiseAbs().maxCoeff();
      EXPECT_LE(growth, share < 0.99 ? 1 + 1e-6 : 1.005)
          << substeps << " substeps, share " << share;
    }
  }
}

// x'' = -x by a force at the end of each substep: halving the substeps quarters the error.
TEST(SubstepScheduleTest, TwoStepsAreOfSecondOrderFromTheFirstSubstepOn) {
  const auto error = [](uint32_t substeps) {
    const SubstepSchedule schedule = TwoSteps(0.25, substeps);
    Scalar state{.x = 1};
    for (int step = 0; step < 8; ++step) {
      Scalar previous = state;
      for (uint32_t index = 0; index < schedule.size(); ++index) {
        const Substep substep = schedule[index];
        const double base = state.x + (state.x - previous.x) / 3 + substep.lead_s * state.v;
        const double ahead = state.v + (state.v - previous.v) / 3;
        // u = ahead - kick x(end), x(end) = base + H u
        const double u = (ahead - substep.kick_within_s * base) /
                         (1 + substep.kick_within_s * substep.interval_s);
        previous = state;
        state = {base + substep.interval_s * u, u};
      }
    }
    return std::hypot(state.x - std::cos(2.0), state.v + std::sin(2.0));
  };
  for (const uint32_t substeps : {8u, 16u, 32u, 64u}) {
    EXPECT_NEAR(error(substeps) / error(2 * substeps), 4, 4.0 / substeps) << substeps;
  }
}

}  // namespace
}  // namespace drape
