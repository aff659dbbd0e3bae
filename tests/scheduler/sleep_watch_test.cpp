#include "server/scheduler/sleep_watch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/support/plain_settings.h"

namespace drape {
namespace {

// Until a cloth that never moves is asleep: patience, then one second.
constexpr int kStepsToSleep = 8 + 60;

class SleepWatchTest : public testing::Test {
 protected:
  SleepWatchTest() { Set(1e-5); }

  void Set(double sleep_motion_m, double time_step_s = 1.0 / 60, double sleep_after_s = 1) {
    StepSettings settings = test::PlainSettings();
    settings.time_step_s = time_step_s;
    settings.sleep_motion_m = sleep_motion_m;
    settings.sleep_after_s = sleep_after_s;
    watch_.Set(settings);
    step_ = 0;
    looks_ = 0;
  }

  // One step after which the second of two particles is at x; the column has a row of another cloth
  // before them.
  void Step(double x_m) {
    StepReport report;
    report.iterations = 7;
    if (watch_.decides_next()) report.measured.lowest_m = step_;
    watch_.CompleteStep(report);
    ++step_;
    if (!watch_.wants_look()) return;
    ++looks_;
    const double other = looks_;  // moves always
    watch_.Look(std::vector<double>{other, other, other, 1, 2, 3, x_m, 5, 6}, 1, 2);
  }

  // The number of steps until it is asleep, at most `most`.
  int StepsAwake(const std::function<double(int)>& x_m, int most) {
    for (int k = 0; k < most; ++k) {
      Step(x_m(k));
      if (watch_.is_asleep()) return k + 1;
    }
    return most;
  }

  SleepWatch watch_;
  int step_ = 0;
  int looks_ = 0;
};

TEST_F(SleepWatchTest, WhatStaysWithinTheLimitForASecondSleeps) {
  EXPECT_EQ(StepsAwake([](int k) { return 4 + 0.45e-5 * std::sin(k); }, 1000), kStepsToSleep);
  EXPECT_TRUE(watch_.report().is_asleep);
  EXPECT_EQ(watch_.report().iterations, 0u);
  EXPECT_EQ(watch_.report().measured.lowest_m, kStepsToSleep - 1) << "of the deciding step";
  watch_.Wake();
  EXPECT_FALSE(watch_.is_asleep());
  EXPECT_FALSE(watch_.state().report.is_asleep) << "its report is kept";
  EXPECT_EQ(StepsAwake([](int) { return 4; }, 1000), kStepsToSleep);
}

TEST_F(SleepWatchTest, SecondsAreSimulated) {
  Set(1e-5, 1.0 / 240);
  EXPECT_EQ(StepsAwake([](int) { return 4; }, 1000), 4 * kStepsToSleep);
}

TEST_F(SleepWatchTest, TheTimeToSleepIsASetting) {
  const auto still = [](int) { return 4; };
  for (const double after_s : {0.5, 2.0, 7.3, 60.0}) {
    Set(1e-5, 1.0 / 60, after_s);
    EXPECT_EQ(StepsAwake(still, 10000), 8 + std::lround(60 * after_s)) << after_s;
  }
  // Each of the eight looks has a step of its own, however short the time.
  Set(1e-5, 1.0 / 60, 0.1);
  EXPECT_EQ(StepsAwake(still, 1000), 8 + 8);
  Set(1e-5, 1.0 / 30, 0.1);
  EXPECT_EQ(StepsAwake(still, 1000), 8 + 8);
}

TEST_F(SleepWatchTest, ALongTimeKeepsASlowCreepAwake) {
  const auto x_m = [](int k) { return 0.6e-5 * k / 60; };
  EXPECT_LT(StepsAwake(x_m, 6000), 6000);
  Set(1e-5, 1.0 / 60, 4);
  EXPECT_EQ(StepsAwake(x_m, 6000), 6000);
}

TEST_F(SleepWatchTest, ZeroNeverSleeps) {
  Set(0);
  EXPECT_EQ(StepsAwake([](int) { return 4; }, 1000), 1000);
  EXPECT_EQ(looks_, 0);
}

// Around a turning point x = A w^2 t^2 / 2: the looks of a second see at least its value after half
// a second, A w^2 / 8 >= 1.3e-5 m for the slowest of these.
TEST_F(SleepWatchTest, ASlowSwingIsAwakeAtItsTurningPoints) {
  for (const double period_s : {1.0, 3.7, 20.0, 60.0, 195.0}) {
    const double w = 2 * M_PI / period_s;
    for (const double phase : {0.0, 0.4, 1.1, 2.9}) {
      Set(1e-5);
      const int most = static_cast<int>(60 * period_s) + 200;
      const auto x_m = [&](int k) { return 0.1 * std::cos(w * k / 60 + phase); };
      EXPECT_EQ(StepsAwake(x_m, most), most) << period_s << " s";
    }
  }
}

// Also where the period divides the times between most looks.
TEST_F(SleepWatchTest, AVibrationIsAwake) {
  for (double period_steps = 2; period_steps <= 60; period_steps += 0.25) {
    Set(1e-5);
    const auto x_m = [&](int k) { return 1e-4 * std::sin(2 * M_PI * (k + 0.3) / period_steps); };
    EXPECT_EQ(StepsAwake(x_m, 2000), 2000) << period_steps;
  }
}

TEST_F(SleepWatchTest, CreepingIsAwake) {
  const auto x_m = [](int k) { return 1.2e-5 * k / 60; };
  EXPECT_EQ(StepsAwake(x_m, 6000), 6000);
}

TEST_F(SleepWatchTest, WhatIsNotANumberIsAwake) {
  const auto x_m = [](int) { return std::numeric_limits<double>::quiet_NaN(); };
  EXPECT_EQ(StepsAwake(x_m, 1000), 1000);
}

// Looks cost a readback: a moving cloth has two per 61 steps once its patience is long.
TEST_F(SleepWatchTest, MovingClothsAreSeldomLookedAt) {
  EXPECT_EQ(StepsAwake([](int k) { return k; }, 6100), 6100);
  EXPECT_LE(looks_, 2 * (6100 / 61 + 4));
}

TEST_F(SleepWatchTest, FaultedClothsAreNotLookedAt) {
  for (int k = 0; k < 100; ++k) {
    StepReport report;
    report.fault = FaultReason::kNotFinite;
    watch_.CompleteStep(report);
    ASSERT_FALSE(watch_.wants_look());
  }
}

}  // namespace
}  // namespace drape
