#include "server/scheduler/grip_track.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/scheduler/fake_backend.h"

namespace drape {
namespace {

using Eigen::Vector3d;
using testing::IsEmpty;

std::vector<uint32_t> ParticlesOf(std::span<const Grip> grips) {
  std::vector<uint32_t> particles;
  for (const Grip& grip : grips) particles.push_back(grip.particle);
  return particles;
}

TEST(GripTrack, WhatIsGrabbedStaysAndKeepsItsOffset) {
  GripTrack track;
  track.Start(2);
  EXPECT_THAT(track.GripsForStep(1), IsEmpty());
  EXPECT_FALSE(track.has_changed());
  track.Grab(1, 5, {1, 2, 3}, {1, 2, 0}, 0);
  ASSERT_EQ(ParticlesOf(track.GripsForStep(1)), std::vector<uint32_t>{5});
  EXPECT_TRUE(track.has_changed());
  EXPECT_EQ(track.GripsForStep(2)[0].target_m, Vector3d(1, 2, 3));
  EXPECT_FALSE(track.has_changed()) << "it rests";
  track.Hold(1, {3, 2, 0}, 4, 2);
  EXPECT_EQ(track.GripsForStep(4)[0].target_m, Vector3d(2, 2, 3));
  EXPECT_TRUE(track.has_changed());
  EXPECT_EQ(track.PositionAt(1, 3), Vector3d(1.5, 2, 3));
  EXPECT_EQ(track.GripsForStep(6)[0].target_m, Vector3d(3, 2, 3));
  track.GripsForStep(7);
  EXPECT_FALSE(track.has_changed());
  track.Hold(1, {3, 2, 0}, 1, 7);
  track.GripsForStep(8);
  EXPECT_FALSE(track.has_changed()) << "it is there already";
}

TEST(GripTrack, GripsComeInOrderOfTheirParticles) {
  GripTrack track;
  track.Start(3);
  track.Grab(0, 9, {9, 0, 0}, {9, 0, 0}, 0);
  track.Grab(2, 4, {4, 0, 0}, {4, 0, 0}, 0);
  EXPECT_EQ(ParticlesOf(track.GripsForStep(1)), (std::vector<uint32_t>{4, 9}));
  EXPECT_EQ(track.particle(0), 9u);
  EXPECT_EQ(track.particle(1), std::nullopt);
  track.Release(0);
  EXPECT_EQ(ParticlesOf(track.GripsForStep(2)), (std::vector<uint32_t>{4}));
  EXPECT_TRUE(track.has_changed());
  track.Reset();
  EXPECT_THAT(track.GripsForStep(3), IsEmpty());
  EXPECT_TRUE(track.has_changed());
}

TEST(GripTrack, AParticleIsInOneSlot) {
  GripTrack track;
  track.Start(2);
  track.Grab(0, 3, {0, 0, 0}, {0, 0, 0}, 0);
  track.Grab(1, 3, {0, 0, 0}, {0, 0, 0}, 0);
  EXPECT_EQ(track.particle(0), std::nullopt);
  EXPECT_EQ(track.particle(1), 3u);
  EXPECT_EQ(track.GripsForStep(1).size(), 1u);
}

TEST(GripTrack, AnOpenGripDoesNotMove) {
  GripTrack track;
  track.Start(1);
  track.Hold(0, {1, 1, 1}, 0, 0);
  track.Release(0);
  EXPECT_THAT(track.GripsForStep(1), IsEmpty());
  EXPECT_FALSE(track.has_changed());
}

TEST(GripTrack, WhatIsPulledTooHardOpens) {
  GripTrack track;
  track.Start(3);
  track.Grab(0, 7, {0, 0, 0}, {0, 0, 0}, 0, 2.0);
  track.Grab(1, 4, {1, 0, 0}, {1, 0, 0}, 0);
  EXPECT_TRUE(track.has_largest_forces());
  track.GripsForStep(1);
  StepImpulses impulses;
  impulses.gripped_particles = {4, 7};
  impulses.grips_n_s = {{100, 0, 0}, {0, 0.6, -0.8}};
  track.OpenOverloaded(impulses, 0.5);  // 2 N: no harder
  EXPECT_EQ(ParticlesOf(track.GripsForStep(2)), (std::vector<uint32_t>{4, 7}));
  EXPECT_FALSE(track.has_changed());
  track.OpenOverloaded(impulses, 0.49);
  EXPECT_EQ(ParticlesOf(track.GripsForStep(3)), (std::vector<uint32_t>{4})) << "without a limit";
  EXPECT_TRUE(track.has_changed());
  EXPECT_FALSE(track.has_largest_forces());
  track.Grab(0, 7, {0, 0, 0}, {0, 0, 0}, 0);
  EXPECT_FALSE(track.has_largest_forces()) << "the limit is that of a grab";
}

TEST(GripTrack, APinIsNotHeldAnyLonger) {
  GripTrack track;
  track.Start(2);
  track.Grab(0, 1, {1, 0, 0}, {1, 0, 0}, 0);
  track.Grab(1, 2, {2, 0, 0}, {2, 0, 0}, 0);
  track.ReleasePins(*ChainModel(3, {1}));
  EXPECT_EQ(track.particle(0), std::nullopt);
  EXPECT_EQ(track.particle(1), 2u);
}

TEST(NearestLooseTest, IsWithinTheRadiusAndNeitherPinnedNorHeld) {
  const auto model = ChainModel(4, {0});
  const ScalarColumn positions = std::vector<float>{9, 9, 9, 0, 0, 0, 1, 0, 0, 2, 0, 0, 2, 0, 0};
  GripTrack grips;
  grips.Start(1);
  const auto nearest = [&](const Vector3d& place, double radius_m) {
    return NearestLoose(*model, grips, positions, 1, place, radius_m);
  };
  EXPECT_EQ(nearest({0, 0, 0}, 0.9), std::nullopt) << "0 is pinned, 1 is too far";
  EXPECT_EQ(nearest({0, 0, 0}, 1), 1u);
  EXPECT_EQ(nearest({1.75, 0, 0}, 1), 2u) << "the first of two at the same place";
  grips.Grab(0, 2, {2, 0, 0}, {2, 0, 0}, 0);
  EXPECT_EQ(nearest({1.75, 0, 0}, 1), 3u);
}

}  // namespace
}  // namespace drape
