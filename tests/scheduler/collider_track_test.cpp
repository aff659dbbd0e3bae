#include "server/scheduler/collider_track.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace drape {
namespace {

using Eigen::Vector3d;
using testing::IsEmpty;

constexpr double kRounding = 16 * 0x1p-53;

ColliderTrack TwoResting() {
  ColliderTrack track;
  track.Rest({Vector3d(1, 0, 0), Vector3d(0, 2, 0)});
  return track;
}

TEST(ColliderTrack, RestingCollidersHaveNoMotions) {
  ColliderTrack track = TwoResting();
  EXPECT_FALSE(track.is_moving());
  EXPECT_EQ(track.collider_count(), 2u);
  EXPECT_THAT(track.MotionsForStep(0, 1), IsEmpty());
  EXPECT_THAT(track.At(1), IsEmpty());
}

TEST(ColliderTrack, AMotionIsCutIntoStepsAndEndsExactlyAtItsTarget) {
  ColliderTrack track = TwoResting();
  track.BeginMoving(1);
  track.Move(0, {.position_m = Vector3d(3, 0, 4)}, 0.75, 1);
  auto motions = track.MotionsForStep(1, 1.5);
  ASSERT_EQ(motions.size(), 2u);
  EXPECT_EQ(motions[0].position_m, Vector3d(1, 0, 0));
  EXPECT_LE((motions[0].velocity_m_per_s - Vector3d(2, 0, 4) / 0.75).norm(), kRounding * 8);
  EXPECT_EQ(motions[1].velocity_m_per_s, Vector3d::Zero());
  // Over within this step: as fast as it takes to end there, and at rest from then on.
  motions = track.MotionsForStep(1.5, 2);
  EXPECT_LE((motions[0].After(0.5).position_m - Vector3d(3, 0, 4)).norm(), kRounding * 8);
  motions = track.MotionsForStep(2, 2.5);
  EXPECT_EQ(motions[0].position_m, Vector3d(3, 0, 4));
  EXPECT_EQ(motions[0].velocity_m_per_s, Vector3d::Zero());
  EXPECT_EQ(track.At(9)[0].position_m, Vector3d(3, 0, 4));
}

TEST(ColliderTrack, ATargetWithoutDurationIsReachedWithinOneStep) {
  ColliderTrack track = TwoResting();
  track.BeginMoving(0);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(1, Vector3d::UnitX()));
  track.Move(1, {.position_m = Vector3d(0, 2, 1), .rotation = turn}, 0, 0);
  const RigidMotion motion = track.MotionsForStep(0, 0.25)[1];
  EXPECT_EQ(motion.position_m, Vector3d(0, 2, 0));
  EXPECT_LE((motion.velocity_m_per_s - Vector3d(0, 0, 4)).norm(), kRounding);
  EXPECT_LE((motion.angular_velocity_rad_per_s - Vector3d(4, 0, 0)).norm(), kRounding * 4);
  EXPECT_EQ(track.MotionsForStep(0.25, 0.5)[1].rotation.coeffs(), turn.coeffs());
  // Before that step has been done, the collider is where it starts.
  EXPECT_EQ(track.At(0)[1].position_m, Vector3d(0, 2, 0));
}

TEST(ColliderTrack, MotionsOfTheirOwnGoOnUntilTheyAreSentSomewhere) {
  RigidMotion turning = RigidMotion::AtRest(Vector3d(1, 0, 0));
  turning.angular_velocity_rad_per_s = Vector3d(0, 3, 0);
  turning.velocity_m_per_s = Vector3d(0.5, 0, 0);
  ColliderTrack track;
  track.Start({turning}, 2);
  EXPECT_TRUE(track.is_moving());
  // More than a turn later: from the start, not step by step.
  const RigidMotion later = track.MotionsForStep(6, 6.5)[0];
  EXPECT_EQ(later.position_m, Vector3d(3, 0, 0));
  EXPECT_EQ(later.velocity_m_per_s, turning.velocity_m_per_s);
  EXPECT_EQ(later.rotation.coeffs(), turning.After(4).rotation.coeffs());
  track.Move(0, {.position_m = Vector3d(3, 1, 0)}, 1, 6);
  const RigidMotion sent = track.MotionsForStep(6, 6.5)[0];
  EXPECT_EQ(sent.position_m, Vector3d(3, 0, 0));
  EXPECT_EQ(sent.velocity_m_per_s, Vector3d(0, 1, 0));
  EXPECT_EQ(track.At(8)[0].rotation.coeffs(), Eigen::Quaterniond::Identity().coeffs());
}

TEST(ColliderTrack, AMotionBeginsWhereTheLastOneIs) {
  ColliderTrack track = TwoResting();
  track.BeginMoving(0);
  track.Move(0, {.position_m = Vector3d(5, 0, 0)}, 4, 0);
  track.Move(0, {.position_m = Vector3d(3, 2, 0)}, 2, 2);
  EXPECT_EQ(track.At(3)[0].position_m, Vector3d(3, 1, 0));
}

// Where a step has put it, to the bit, until the next step does.
TEST(ColliderTrack, ABodyFollowsItsSteps) {
  ColliderTrack track = TwoResting();
  track.BeginMoving(0);
  RigidMotion moved = RigidMotion::AtRest({1, 2, 3});
  moved.position_m = {0.1, 0.2, 0.3};
  moved.velocity_m_per_s = {0, -1.0 / 3, 0};
  moved.angular_velocity_rad_per_s = {0.7, 0, 0};
  moved.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
  track.Follow(1, moved, 0.1);
  const std::span<const RigidMotion> motions = track.MotionsForStep(0.1, 0.2);
  EXPECT_EQ(motions[1].position_m, moved.position_m);
  EXPECT_EQ(motions[1].rotation.coeffs(), moved.rotation.coeffs());
  EXPECT_EQ(motions[1].velocity_m_per_s, moved.velocity_m_per_s);
  EXPECT_EQ(motions[1].angular_velocity_rad_per_s, moved.angular_velocity_rad_per_s);
  EXPECT_EQ(track.At(0.1)[1].position_m, moved.position_m);
}

}  // namespace
}  // namespace drape
