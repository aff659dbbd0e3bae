// What is clear of a collider does not touch it, wherever it is and however both move.
#include "server/solver/cpu/step/lane_clearance-inl.h"

#include <gtest/gtest.h>

#include "server/solver/cpu/step/collider_surface.h"
#include "tests/cpu/random_places.h"
#include "tests/support/reach_scenes.h"
#include "tests/support/scenes.h"

namespace drape::cpu {
namespace {

using namespace HWY_NAMESPACE;  // one lane
using Eigen::Vector3d;

constexpr double kSubstep_s = 1.0 / 3000;

struct ClearCount {
  uint32_t clear = 0, all = 0;
};

// A particle that was at p when a substep started, and is at q in a later one.
template <class Surface>
void LookAround(const Surface& first, const Surface& later, RandomPlaces& places,
                ClearCount& count) {
  const Vec4 p = ToVec4(places.Any());
  const VectorsCloths start = SplatVectors(p);
  const ClothClearance clearance = first.ClearanceAtStart(start, first.GapAtStart(start).gap);
  const float way = hn::GetLane(clearance.way.v);
  if (!(way > 0)) return;
  for (uint32_t k = 0; k < 20; ++k) {
    const auto distance = static_cast<float>(places.Between(0, 1.5));
    const VectorsCloths q = SplatVectors(p + way * distance * ToVec4(places.Direction()));
    const VecCloths touching = later.RoundOff(q) + later.RoundOff(q);
    ++count.all;
    if (AreAllLanesSet(later.IsClearAtStart(clearance, q))) {
      EXPECT_TRUE(AreAllLanesSet(later.GapAtStart(q).gap > touching));
    }
    if (!AreAllLanesSet(later.IsClearAtEnd(clearance, q))) continue;
    ++count.clear;
    EXPECT_TRUE(AreAllLanesSet(later.GapAtEnd(q).gap > touching));
  }
}

TEST(LaneClearanceTest, WhatIsClearDoesNotTouch) {
  const auto kinds = test::EveryKind(0);
  ClearCount resting, moving;
  for (uint32_t seed = 0; seed < 3000; ++seed) {
    RandomPlaces places(seed);
    test::Scene scene = test::SizedCloth(9, false);
    const Collider& described = kinds[seed % kinds.size()].second;
    RigidMotion motion = RigidMotion::AtRest(CentreOf(described));
    motion.position_m = 2 * places.Any();
    motion.rotation = places.Rotation();
    scene.parameters.colliders = {Moved(described, motion)};
    const FloatModel model(scene.model);
    const FloatControls controls(model, scene.parameters, false);
    const FloatCollider& collider = controls.colliders[0];
    const ClothCollider in_lanes = InAllLanes(collider);
    const RestingOfCloth rests(in_lanes, collider);
    LookAround(rests, rests, places, resting);
    motion = RigidMotion::AtRest(CentreOf(scene.parameters.colliders[0]));
    motion.velocity_m_per_s = 10 * places.Any();
    motion.angular_velocity_rad_per_s = places.Between(0, 30) * places.Direction();
    MovingSurface surface(collider, motion, kSubstep_s);
    const auto advance = [&] {
      for (uint32_t k = 0; k < seed % 4; ++k) surface.Advance();
    };
    advance();  // a gap is looked at in any substep
    const MovingSurface first = surface;
    advance();
    constexpr auto kDuration = static_cast<float>(kSubstep_s);
    const ClothMotion of_first = InAllLanes(first, kDuration);
    const ClothMotion of_later = InAllLanes(surface, kDuration);
    LookAround(MovingOfCloth(in_lanes, collider, of_first, first),
               MovingOfCloth(in_lanes, collider, of_later, surface), places, moving);
  }
  // Most of what is within the way is found clear, if the collider rests.
  EXPECT_GT(resting.clear, resting.all / 2);
  EXPECT_GT(moving.clear, moving.all / 5);
}

TEST(LaneClearanceTest, NothingIsClearWhereItIsNoNumber) {
  const VecCloths zero = SplatCloths(0), one = SplatCloths(1);
  const ClothClearance clearance = {{zero, zero, zero}, one, zero, zero};
  const auto is_clear = [&](float x, float surface_way) {
    return AreAllLanesSet(
        IsClear(clearance, SplatVectors(Vec4{x, 0, 0, 0}), SplatCloths(surface_way)));
  };
  EXPECT_TRUE(is_clear(0.9f, 0));
  EXPECT_FALSE(is_clear(0.9f, 0.2f));
  EXPECT_FALSE(is_clear(0, 1));
  EXPECT_FALSE(is_clear(std::nanf(""), 0));
}

}  // namespace
}  // namespace drape::cpu
