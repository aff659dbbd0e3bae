#include "server/scheduler/track.h"

#include <gtest/gtest.h>

#include <Eigen/Core>

namespace drape {
namespace {

using Eigen::Vector3d;

// One element at rest at the origin.
Track<Vector3d> AtOrigin() {
  Track<Vector3d> track;
  track.Start({{Vector3d::Zero(), Vector3d::Zero(), 0, 0}}, false);
  return track;
}

TEST(Track, WithoutElementsThereAreNoTargets) {
  Track<Vector3d> track;
  track.Start({}, false);
  EXPECT_TRUE(track.TargetsForStep(1).empty());
}

TEST(Track, TheFirstStepGetsAllTargetsAndTheNextNone) {
  Track<Vector3d> track;
  track.Start(
      {{Vector3d(0, 0, 0), Vector3d(0, 2, 0), 0, 0}, {Vector3d(1, 0, 0), Vector3d(1, 0, 0), 0, 0}},
      false);
  const auto targets = track.TargetsForStep(0.5);
  ASSERT_EQ(targets.size(), 2u);
  EXPECT_EQ(targets[0], Vector3d(0, 2, 0));
  EXPECT_EQ(targets[1], Vector3d(1, 0, 0));
  EXPECT_TRUE(track.TargetsForStep(1).empty());
}

TEST(Track, AMotionIsCutIntoStepsAndEndsExactlyAtItsTarget) {
  Track<Vector3d> track = AtOrigin();
  track.TargetsForStep(1);
  track.Move(0, Vector3d(0.3, 0, 0), 2, 1);
  EXPECT_EQ(track.TargetsForStep(2)[0], Vector3d(0.15, 0, 0));
  EXPECT_EQ(track.TargetsForStep(3)[0], Vector3d(0.3, 0, 0));
  EXPECT_FALSE(AtOrigin().is_settled());
  EXPECT_TRUE(track.is_settled());
  EXPECT_TRUE(track.TargetsForStep(4).empty());
}

TEST(Track, WhatIsSentAgainIsNoNews) {
  Track<Vector3d> track = AtOrigin();
  track.TargetsForStep(1);
  EXPECT_TRUE(track.has_news());
  track.TargetsForStep(2);
  EXPECT_FALSE(track.has_news());
  track.SendAgain();
  EXPECT_EQ(track.TargetsForStep(3).size(), 1u);
  EXPECT_FALSE(track.has_news());
  track.SendAgain();
  track.Move(0, Vector3d(1, 0, 0), 2, 3);
  for (const double end_s : {4, 5}) {
    track.TargetsForStep(end_s);
    EXPECT_TRUE(track.has_news());
    track.SendAgain();
  }
  track.TargetsForStep(6);
  EXPECT_FALSE(track.has_news());
}

TEST(Track, AMotionBeginsWhereTheLastOneIs) {
  Track<Vector3d> track = AtOrigin();
  track.Move(0, Vector3d(4, 0, 0), 4, 0);
  track.Move(0, Vector3d(2, 8, 0), 2, 2);  // at (2, 0, 0) then
  EXPECT_EQ(track.At(3)[0], Vector3d(2, 4, 0));
}

}  // namespace
}  // namespace drape
