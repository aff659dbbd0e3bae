// What is clear of a collider does not touch it, wherever it is and however both move.
#include "server/solver/cpu/step/clearance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "server/solver/cpu/step/collider_gap.h"
#include "server/solver/cpu/step/collider_surface.h"
#include "tests/support/reach_scenes.h"
#include "tests/support/scenes.h"

namespace drape::cpu {
namespace {

using Eigen::Vector3d;

constexpr double kSubstep_s = 1.0 / 3000;

class RandomPlaces {
 public:
  explicit RandomPlaces(uint32_t seed) : random_(seed), size_m_(std::pow(10, Between(-1, 2.5))) {}
  double Between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Vector3d Any() { return size_m_ * Vector3d(Between(-1, 1), Between(-1, 1), Between(-1, 1)); }
  Vector3d Direction() { return Any().normalized(); }
  double size_m() const { return size_m_; }

 private:
  std::mt19937 random_;
  double size_m_;
};

struct ClearCount {
  uint32_t clear = 0, all = 0;
};

// A particle that was at p and is at q now. `move` leads the surface to a later substep.
template <class Surface, class Move>
void LookAround(Surface surface, RandomPlaces& places, const Move& move, ClearCount& count) {
  const Vec4 p = ToVec4(places.Any());
  const Clearance clearance = surface.ClearanceAtStart(p, surface.GapAtStart(p).gap);
  move(surface);
  if (!(clearance.way > 0)) return;
  for (uint32_t k = 0; k < 20; ++k) {
    const float way = clearance.way * static_cast<float>(places.Between(0, 1.5));
    const Vec4 q = p + way * ToVec4(places.Direction());
    ++count.all;
    if (surface.IsClearAtStart(clearance, q)) {
      EXPECT_GT(surface.GapAtStart(q).gap, 2 * surface.RoundOff(q));
    }
    if (!surface.IsClearAtEnd(clearance, q)) continue;
    ++count.clear;
    EXPECT_GT(surface.GapAtEnd(q).gap, 2 * surface.RoundOff(q));
  }
}

TEST(ClearanceTest, WhatIsClearDoesNotTouch) {
  const auto kinds = test::EveryKind(0);
  ClearCount resting, moving;
  for (uint32_t seed = 0; seed < 3000; ++seed) {
    RandomPlaces places(seed);
    test::Scene scene = test::SizedCloth(9, false);
    const Collider& described = kinds[seed % kinds.size()].second;
    RigidMotion motion = RigidMotion::AtRest(CentreOf(described));
    motion.position_m = 2 * places.Any();
    motion.rotation =
        Eigen::Quaterniond(Eigen::AngleAxisd(places.Between(0, 6), places.Direction()));
    scene.parameters.colliders = {Moved(described, motion)};
    const FloatModel model(scene.model);
    const FloatControls controls(model, scene.parameters, false);
    LookAround(
        RestingSurface(controls.colliders[0]), places, [](const auto&) {}, resting);
    motion = RigidMotion::AtRest(CentreOf(scene.parameters.colliders[0]));
    motion.velocity_m_per_s = 10 * places.Any();
    motion.angular_velocity_rad_per_s = places.Between(0, 30) * places.Direction();
    MovingSurface surface(controls.colliders[0], motion, kSubstep_s);
    const auto advance = [&](MovingSurface& of) {
      for (uint32_t k = 0; k < seed % 4; ++k) of.Advance();
    };
    advance(surface);  // a clearance is found in any substep
    LookAround(surface, places, advance, moving);
  }
  // Most of what is within the way is found clear, if the collider rests.
  EXPECT_GT(resting.clear, resting.all / 2);
  EXPECT_GT(moving.clear, moving.all / 5);
}

TEST(ClearanceTest, NothingIsClearBeforeItsGapIsLookedAtNorWhereItIsNoNumber) {
  EXPECT_FALSE(IsClear({}, Vec4{}, 0));
  EXPECT_FALSE(IsClear({Vec4{}, 1}, Vec4{std::nanf(""), 0, 0, 0}, 0));
  EXPECT_TRUE(IsClear({Vec4{}, 1}, Vec4{0.9f, 0, 0, 0}, 0));
  EXPECT_FALSE(IsClear({Vec4{}, 1}, Vec4{0.9f, 0, 0, 0}, 0.2f));
}

}  // namespace
}  // namespace drape::cpu
