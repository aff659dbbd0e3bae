#include "server/scene/pin_motion.h"

#include <gtest/gtest.h>

namespace drape {
namespace {

const PinMotion kMotion{
    .start_m = {0.1, 0, 0}, .target_m = {0.3, 1, -2}, .start_s = 1, .over_s = 0.5};

TEST(PinMotion, IsConstantBeforeAndExactlyAtTheTargetAfter) {
  EXPECT_EQ(kMotion.At(0), kMotion.start_m);
  EXPECT_EQ(kMotion.At(1), kMotion.start_m);
  EXPECT_EQ(kMotion.At(1.5), kMotion.target_m);
  EXPECT_EQ(kMotion.At(100), kMotion.target_m);
  EXPECT_FALSE(kMotion.IsOver(1.4999));
  EXPECT_TRUE(kMotion.IsOver(1.5));
}

TEST(PinMotion, IsAStraightLineBetween) {
  const Eigen::Vector3d middle = kMotion.At(1.25);
  // Half of the way: one rounding each of the difference, product and sum of numbers below 2.
  EXPECT_LE((middle - Eigen::Vector3d(0.2, 0.5, -1)).cwiseAbs().maxCoeff(), 4 * 2.3e-16);
}

TEST(PinMotion, OverZeroSecondsJumps) {
  PinMotion jump = kMotion;
  jump.over_s = 0;
  EXPECT_EQ(jump.At(0.999), jump.start_m);
  EXPECT_EQ(jump.At(1), jump.target_m);
}

}  // namespace
}  // namespace drape
