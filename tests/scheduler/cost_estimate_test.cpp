#include "server/scheduler/cost_estimate.h"

#include <gtest/gtest.h>

namespace drape {
namespace {

TEST(SolveRate, FollowsWhatBatchesCost) {
  SolveRate rate;
  for (int k = 0; k < 500; ++k) rate.Measured(2e6, 1e4);
  EXPECT_NEAR(rate.us_per_solve(), 5e-3, 1e-5);
}

// Many small steps, nearly all of them overhead, do not make a large one look expensive.
TEST(SolveRate, SmallStepsSayLittleAboutLargeOnes) {
  SolveRate rate;
  for (int k = 0; k < 1000; ++k) rate.Measured(1000 + kSolvesPerClothStep, 60);
  EXPECT_LT(rate.us_per_solve(), 2e-3);
}

TEST(CostEstimate, WithoutMeasurementsItIsWhatTheSolvesCost) {
  SolveRate rate;
  const CostEstimate cost;
  EXPECT_NEAR(cost.Expected_us(1e9, false, rate), 1e9 * rate.us_per_solve(), 100);
  EXPECT_NEAR(cost.Expected_us(1e9, true, rate), kLeastShareOfCost * 1e9 * rate.us_per_solve(),
              100);
}

TEST(CostEstimate, RisesQuicklyAndFallsSlowly) {
  const SolveRate rate;
  CostEstimate cost;
  cost.Measured(100);
  EXPECT_EQ(cost.Expected_us(1, false, rate), 100);
  cost.Measured(300);
  EXPECT_EQ(cost.Expected_us(1, false, rate), 200);
  cost.Measured(100);
  EXPECT_EQ(cost.Expected_us(1, false, rate), 180);
  cost.Forget();
  EXPECT_LT(cost.Expected_us(1, false, rate), 100);
}

// A thousand quick steps of a cloth that may need 20 seconds: it still counts as a long one.
TEST(CostEstimate, WhatAStepMayCostIsNeverForgotten) {
  const SolveRate rate;
  CostEstimate cost;
  for (int k = 0; k < 1000; ++k) cost.Measured(10);
  const double solves = 2e7 / rate.us_per_solve();
  EXPECT_NEAR(cost.Expected_us(solves, true, rate), kLeastShareOfCost * 2e7, 1e4);
}

}  // namespace
}  // namespace drape
