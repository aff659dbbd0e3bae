#include "client/cli/comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/client/client_test_support.h"

namespace drape::cli {
namespace {

using client_test::ErrorOf;
using client_test::MakeStates;

TEST(CompareTest, FindsTheLargestDistanceAndWhereItIs) {
  PositionDifference difference;
  const States a = MakeStates<float>({1, 2}, 4, {0, 0, 0, 1, 1, 1, 2, 2, 2}, {});
  const States b = MakeStates<double>({1, 2}, 4, {0, 0, 0.5, 1, 1, 1, 2, 5, 6}, {});
  Compare(a, b, &difference);
  EXPECT_DOUBLE_EQ(difference.largest_m, 5);
  EXPECT_EQ(difference.cloth, 1u);
  EXPECT_EQ(difference.particle, 1u);
  EXPECT_EQ(difference.step, 4u);
  // A later, smaller one changes nothing.
  Compare(MakeStates<float>({1}, 5, {0, 0, 0}, {}), MakeStates<float>({1}, 5, {1, 0, 0}, {}),
          &difference);
  EXPECT_EQ(difference.step, 4u);
}

TEST(CompareTest, WhatIsNoNumberIsTheLargest) {
  PositionDifference difference;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Compare(MakeStates<float>({1}, 1, {nan, 0, 0}, {}), MakeStates<float>({1}, 1, {0, 0, 0}, {}),
          &difference);
  EXPECT_TRUE(std::isnan(difference.largest_m));
  Compare(MakeStates<float>({1}, 2, {9, 0, 0}, {}), MakeStates<float>({1}, 2, {0, 0, 0}, {}),
          &difference);
  EXPECT_TRUE(std::isnan(difference.largest_m));
}

TEST(CompareTest, OnlyStatesOfTheSameStepsCompare) {
  PositionDifference difference;
  const States one = MakeStates<float>({1}, 1, {0, 0, 0}, {});
  const States later = MakeStates<float>({1}, 2, {0, 0, 0}, {});
  const States more = MakeStates<float>({1, 1}, 1, {0, 0, 0, 0, 0, 0}, {});
  EXPECT_EQ(ErrorOf([&] { Compare(one, later, &difference); }).reason, "NOT_COMPARABLE");
  EXPECT_EQ(ErrorOf([&] { Compare(one, more, &difference); }).reason, "NOT_COMPARABLE");
}

}  // namespace
}  // namespace drape::cli
