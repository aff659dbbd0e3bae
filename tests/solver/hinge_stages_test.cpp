#include "server/solver/hinge_stages.h"

#include <gtest/gtest.h>

#include <cmath>

#include "server/solver/solver_constants.h"

namespace drape {
namespace {

// What the stages leave of a deflection whose s omega^2 is x: a kick takes x times it.
double Left(uint32_t count, double x) {
  double left = 1, change = 0;
  for (const HingeStage& stage : HingeStages(count)) {
    change = stage.momentum * change - stage.gain * x * left;
    left += change;
  }
  return left;
}

TEST(HingeStagesTest, SlowDeflectionsFeelTheirForce) {
  constexpr double kSlow = 1e-6;
  for (uint32_t count = 1; count <= kMaxHingeStages; ++count) {
    // 1 - x + x^2 ..., as an implicit step
    EXPECT_NEAR(Left(count, kSlow), 1 - kSlow, kSlow * kSlow + 1e-14) << count;
  }
}

TEST(HingeStagesTest, FastDeflectionsAreTakenAwayUpToTheLargestRatio) {
  for (uint32_t count = 1; count <= kMaxHingeStages; ++count) {
    const double largest = LargestHingeRatio(count);
    double least = 1;
    for (double share = 0; share <= 1; share += 1e-3) {
      const double left = Left(count, share * largest);
      least = std::min(least, left);
      EXPECT_LE(left, 1 + 1e-12) << count << " stages, " << share;
      EXPECT_GE(left, -kHingeResidual - 1e-12) << count << " stages, " << share;
    }
    EXPECT_NEAR(std::abs(Left(count, largest)), kHingeResidual, 1e-9) << count;
    EXPECT_GT(std::abs(Left(count, 1.1 * largest)), kHingeResidual) << count;
  }
}

// p' = R (b + H u), u' = (p' - b) / H with R the share that is left, b and u extrapolated from two
// states with (4 - 1/z) / 3: no root z of that is outside the unit circle.
TEST(HingeStagesTest, TwoStepsThrowNothingBack) {
  for (double left = -kHingeResidual; left < 0; left += 1e-3) {
    const double growth = left - std::sqrt(left * left - left);  // of the state per extrapolation
    // z^2 - 4/3 g z + g/3 = 0
    const double half = 2.0 / 3 * growth;
    const double root = std::sqrt(half * half - growth / 3);
    EXPECT_LE(std::max(std::abs(half + root), std::abs(half - root)), 1) << left;
  }
}

TEST(HingeStagesTest, TheFewestStagesAreTaken) {
  EXPECT_EQ(HingeStageCount(0.1), 1u);
  for (uint32_t count = 1; count < kMaxHingeStages; ++count) {
    EXPECT_EQ(HingeStageCount(LargestHingeRatio(count) * (1 - 1e-9)), count);
    EXPECT_EQ(HingeStageCount(LargestHingeRatio(count) * (1 + 1e-9)), count + 1);
  }
  EXPECT_EQ(HingeStageCount(1e30), kMaxHingeStages);
  EXPECT_TRUE(HingeStages(0).empty());
}

}  // namespace
}  // namespace drape
