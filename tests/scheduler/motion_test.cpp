#include "server/scheduler/motion.h"

#include <gtest/gtest.h>

#include <Eigen/Core>

namespace drape {
namespace {

using Eigen::Vector3d;

const Motion<Vector3d> kMotion{
    .start = {0.1, 0, 0}, .goal = Vector3d(0.3, 1, -2), .start_s = 1, .over_s = 0.5};

TEST(Motion, IsConstantBeforeAndExactlyAtTheTargetAfter) {
  EXPECT_EQ(kMotion.TargetAt(0), kMotion.start);
  EXPECT_EQ(kMotion.TargetAt(1), kMotion.start);
  EXPECT_EQ(kMotion.TargetAt(1.5), *kMotion.goal);
  EXPECT_EQ(kMotion.TargetAt(100), *kMotion.goal);
  EXPECT_FALSE(kMotion.IsOver(1.4999));
  EXPECT_TRUE(kMotion.IsOver(1.5));
}

TEST(Motion, IsAStraightLineBetween) {
  const Vector3d middle = kMotion.TargetAt(1.25);
  // Half of the way: one rounding each of the difference, product and sum of numbers below 2.
  EXPECT_LE((middle - Vector3d(0.2, 0.5, -1)).cwiseAbs().maxCoeff(), 4 * 2.3e-16);
}

TEST(Motion, OverZeroSecondsJumps) {
  Motion<Vector3d> jump = kMotion;
  jump.over_s = 0;
  EXPECT_EQ(jump.TargetAt(0.999), jump.start);
  EXPECT_EQ(jump.TargetAt(1), *jump.goal);
  // The value itself is there when the step has been done.
  EXPECT_EQ(jump.At(1), jump.start);
  EXPECT_EQ(jump.At(1.001), *jump.goal);
}

TEST(Motion, WithoutAGoalABodyContinuesByItself) {
  Motion<RigidMotion> motion{RigidMotion::AtRest(Vector3d(1, 0, 0)), {}, 2, 0};
  motion.start.velocity_m_per_s = Vector3d(0, 3, 0);
  EXPECT_FALSE(motion.IsOver(100));
  EXPECT_EQ(motion.At(1).position_m, Vector3d(1, 0, 0));
  EXPECT_EQ(motion.At(4).position_m, Vector3d(1, 6, 0));
}

}  // namespace
}  // namespace drape
