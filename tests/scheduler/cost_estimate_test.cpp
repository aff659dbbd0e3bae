#include "server/scheduler/cost_estimate.h"

#include <gtest/gtest.h>

#include <array>

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

TEST(CostEstimate, AStepLeftUndoneCountsForMoreEachTime) {
  const SolveRate rate;
  CostEstimate cost;
  cost.Measured(100);
  cost.LeftUndone(30);  // it had hardly begun
  EXPECT_EQ(cost.Expected_us(1, false, rate), 100);
  for (double us = 400; us < 1e5; us *= 2) {
    cost.LeftUndone(us / 2);
    EXPECT_EQ(cost.Expected_us(1, false, rate), us);
  }
}

TEST(CostEstimate, ABatchIsSharedByTheTimeOfItsThreads) {
  const SolveRate rate;
  CostEstimate heavy, light;
  const std::array<ClothCost, 2> timed = {{{&heavy, 100, 3000, false}, {&light, 100, 1000, false}}};
  const DoneWork done = ShareCost(timed, 2000);
  EXPECT_EQ(done.solves, 200 + 2 * kSolvesPerClothStep);
  EXPECT_EQ(done.cost_us, 2000);
  EXPECT_EQ(heavy.Expected_us(1, false, rate), 1500);
  EXPECT_EQ(light.Expected_us(1, false, rate), 500);
}

TEST(CostEstimate, ABatchIsSharedBySolvesWhereNobodyTellsTheTime) {
  const SolveRate rate;
  CostEstimate heavy, light;
  const std::array<ClothCost, 2> untimed = {
      {{&heavy, 2 * kSolvesPerClothStep, 0, false}, {&light, 0, 0, false}}};
  EXPECT_EQ(ShareCost(untimed, 2000).solves, 4 * kSolvesPerClothStep);
  EXPECT_EQ(heavy.Expected_us(1, false, rate), 1500);
  EXPECT_EQ(light.Expected_us(1, false, rate), 500);
}

// Its time is not that of its step, and of its solves nobody knows how many it made.
TEST(CostEstimate, WhatWasLeftUndoneIsNoMeasurement) {
  const SolveRate rate;
  CostEstimate done, undone, waiting;
  const std::array<ClothCost, 3> cloths = {
      {{&done, 0, 1000, false}, {&undone, 1e9, 3000, true}, {&waiting, 1e9, 0, true}}};
  const DoneWork work = ShareCost(cloths, 2000);
  EXPECT_EQ(work.solves, kSolvesPerClothStep);
  EXPECT_EQ(work.cost_us, 500) << "a cloth that is new to the server would look as costly";
  EXPECT_EQ(done.Expected_us(1, false, rate), 500);
  EXPECT_EQ(undone.Expected_us(1, false, rate), 6000);
  EXPECT_NEAR(waiting.Expected_us(1, false, rate), kSolvesPerClothStep * rate.us_per_solve(), 1);
}

}  // namespace
}  // namespace drape
