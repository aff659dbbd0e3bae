#include "server/scheduler/length_track.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace drape {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// Three constraints along a row of four particles: two colours, so the model's order is 0, 2, 1.
std::shared_ptr<const SceneModel> Row(std::vector<uint32_t> pins = {}) {
  ParticleTopology row;
  for (uint32_t i = 0; i < 4; ++i) {
    row.positions_m.emplace_back(i, 0, 0);
    row.masses_kg.push_back(1);
    if (i > 0) row.distance_constraints.push_back({i - 1, i, 1.0 * i, 0});
  }
  return SceneModel::Build({row, {}, std::move(pins)}).value();
}

TEST(LengthTrack, AClothThatIsNotDrivenHasNoTargets) {
  LengthTrack track;
  EXPECT_FALSE(track.is_driven());
  EXPECT_THAT(track.TargetsForStep(1), IsEmpty());
  track.Start(*Row());
  EXPECT_TRUE(track.is_driven());
  EXPECT_THAT(track.TargetsForStep(1), IsEmpty());
  EXPECT_THAT(track.LengthsAt(0), ElementsAre(1, 3, 2));
}

TEST(LengthTrack, AMotionIsCutIntoStepsAndEndsExactlyAtItsTarget) {
  LengthTrack track;
  track.Start(*Row());
  track.Move(*track.FindConstraint(*Row(), 1), 2.3, 2, 1);
  EXPECT_THAT(track.TargetsForStep(2), ElementsAre(1, 3, testing::DoubleEq(2.15)));
  EXPECT_THAT(track.TargetsForStep(3), ElementsAre(1, 3, 2.3));
  EXPECT_THAT(track.TargetsForStep(4), IsEmpty());
}

TEST(LengthTrack, AMotionBeginsWhereTheLastOneIs) {
  LengthTrack track;
  track.Start(*Row());
  track.Move(0, 5, 4, 0);
  track.Move(0, 1, 2, 2);  // at 3 m then
  EXPECT_EQ(track.LengthsAt(3)[0], 2);
  EXPECT_THAT(track.TargetsForStep(4), ElementsAre(1, 3, 2));
}

TEST(LengthTrack, ScalesTheLengthsOfTheModel) {
  const auto model = Row();
  LengthTrack track;
  track.Start(*model);
  track.Move(0, 9, 0, 0);
  track.Scale(*model, 0.5, 0, 0);
  EXPECT_THAT(track.TargetsForStep(1), ElementsAre(0.5, 1.5, 1));
}

// Pins 1 and 2 leave constraint 1 out and later bring it back, with the model's length.
TEST(LengthTrack, MotionsGoOnUnderOtherPins) {
  LengthTrack track;
  track.Start(*Row());
  track.Move(*track.FindConstraint(*Row(), 2), 4, 2, 0);
  track.Move(*track.FindConstraint(*Row(), 1), 7, 0, 0);
  LengthTrack pinned = track.CarriedTo(*Row({1, 2}));
  EXPECT_EQ(pinned.FindConstraint(*Row({1, 2}), 1), std::nullopt);
  EXPECT_EQ(pinned.FindConstraint(*Row({1, 2}), 3), std::nullopt);
  EXPECT_THAT(pinned.LengthsAt(1), ElementsAre(1, 3.5));
  EXPECT_THAT(pinned.CarriedTo(*Row()).LengthsAt(1), ElementsAre(1, 3.5, 2));
  EXPECT_FALSE(LengthTrack().CarriedTo(*Row()).is_driven());
}

}  // namespace
}  // namespace drape
