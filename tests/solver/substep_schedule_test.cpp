#include "server/solver/substep_schedule.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>

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
