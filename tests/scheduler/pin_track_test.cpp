#include "server/scheduler/pin_track.h"

#include <gtest/gtest.h>

namespace drape {
namespace {

using Eigen::Vector3d;

TEST(PinTrack, WithoutPinsThereAreNoTargets) {
  PinTrack track;
  track.Start({}, {}, 0);
  EXPECT_TRUE(track.TargetsForStep(1).empty());
}

TEST(PinTrack, TheFirstStepGetsAllTargetsAndTheNextNone) {
  PinTrack track;
  track.Start({Vector3d(0, 0, 0), Vector3d(1, 0, 0)}, {Vector3d(0, 2, 0), Vector3d(1, 0, 0)}, 0);
  const auto targets = track.TargetsForStep(0.5);
  ASSERT_EQ(targets.size(), 2u);
  EXPECT_EQ(targets[0], Vector3d(0, 2, 0));
  EXPECT_EQ(targets[1], Vector3d(1, 0, 0));
  EXPECT_TRUE(track.TargetsForStep(1).empty());
}

TEST(PinTrack, AMotionIsCutIntoStepsAndEndsExactlyAtItsTarget) {
  PinTrack track;
  track.Start({Vector3d::Zero()}, {Vector3d::Zero()}, 0);
  track.TargetsForStep(1);
  track.Move(0, Vector3d(0.3, 0, 0), 2, 1);
  EXPECT_EQ(track.TargetsForStep(2)[0], Vector3d(0.15, 0, 0));
  EXPECT_EQ(track.TargetsForStep(3)[0], Vector3d(0.3, 0, 0));
  EXPECT_TRUE(track.TargetsForStep(4).empty());
}

TEST(PinTrack, AMotionBeginsWhereTheLastOneIs) {
  PinTrack track;
  track.Start({Vector3d::Zero()}, {Vector3d::Zero()}, 0);
  track.Move(0, Vector3d(4, 0, 0), 4, 0);
  track.Move(0, Vector3d(2, 8, 0), 2, 2);  // at (2, 0, 0) then
  EXPECT_EQ(track.At(0, 3), Vector3d(2, 4, 0));
}

}  // namespace
}  // namespace drape
