// A collider that moves has the gaps of one that rests where it is.
#include "server/solver/cpu/step/collider_surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "server/solver/cpu/model/float_controls.h"
#include "server/solver/cpu/model/float_model.h"
#include "tests/cpu/random_places.h"
#include "tests/support/reach_scenes.h"
#include "tests/support/scenes.h"

namespace drape::cpu {
namespace {

using Eigen::Vector3d;

constexpr double kOneSubstep_s = 1.0 / 3000;

RigidMotion Turned(RandomPlaces& places, const Vector3d& pivot_m) {
  RigidMotion motion = RigidMotion::AtRest(pivot_m);
  motion.position_m = places.Any();
  motion.rotation = places.Rotation();
  return motion;
}

float SizeOf(Vec4 v) {
  return std::abs(v[0]) + std::abs(v[1]) + std::abs(v[2]);
}

// `exact`: where the collider is then. Gap and, where it has one direction, normal.
void ExpectSame(const Gap& gap, const Collider& exact, double thickness_m, Vec4 q, Vec4 point,
                uint32_t seed) {
  const SurfaceDistance truth = SurfaceOf(exact, ToVector3d(q));
  // What contacts allow for, and the corner of a box turns with its axes.
  const double rounding = double{kTouchRoundOff} * (double{SizeOf(q)} + double{SizeOf(point)} + 2);
  EXPECT_NEAR(gap.gap, truth.distance_m - thickness_m, rounding) << seed;
  if (truth.distance_m < 0.01) return;  // inside another face may be as near
  EXPECT_LT((ToVector3d(gap.normal) - truth.outward).norm(), 4 * rounding / truth.distance_m)
      << seed;
}

TEST(MovingSurfaceTest, HasTheGapsOfWhatRestsThere) {
  const auto kinds = test::EveryKind(0);
  uint32_t outside = 0;
  for (uint32_t seed = 0; seed < 3000; ++seed) {
    RandomPlaces random(seed);
    test::Scene scene = test::SizedCloth(9, false);
    const Collider& described = kinds[seed % kinds.size()].second;
    // Distances of maps are compared within their grid, where both interpolate the same.
    if (described.kind() == ShapeKind::kDistanceMap) continue;
    scene.parameters.colliders = {Moved(described, Turned(random, CentreOf(described)))};
    const Collider& collider = scene.parameters.colliders[0];
    const FloatModel model(scene.model);
    const FloatControls controls(model, scene.parameters, false);
    RigidMotion motion = Turned(random, CentreOf(collider) + random.Vector());
    motion.velocity_m_per_s = 10 * random.Vector();
    if (seed % 3 != 0) motion.angular_velocity_rad_per_s = 30 * random.Vector();
    MovingSurface surface(controls.colliders[0], motion, kOneSubstep_s);
    const uint32_t substeps = seed % 5;
    for (uint32_t k = 0; k < substeps; ++k) surface.Advance();
    for (uint32_t k = 0; k < 20; ++k) {
      const Vector3d centre_m = ToVector3d(surface.end().place.point);
      const Vec4 q = ToVec4(Vector3d(centre_m + 2 * random.Vector()));
      const double thickness_m = scene.parameters.thickness_m;
      ExpectSame(surface.GapAtStart(q), Moved(collider, motion.After(substeps * kOneSubstep_s)),
                 thickness_m, q, surface.start().place.point, seed);
      ExpectSame(surface.GapAtEnd(q), Moved(collider, motion.After((substeps + 1) * kOneSubstep_s)),
                 thickness_m, q, surface.end().place.point, seed);
      outside += surface.GapAtEnd(q).gap > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(outside, 10000u);
}

}  // namespace
}  // namespace drape::cpu
