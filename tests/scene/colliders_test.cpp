#include "server/scene/colliders.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/solids/solids.h"

namespace drape {
namespace {

using Eigen::Vector3d;

TEST(NormalOnSegment, IsTheMostUprightPerpendicular) {
  const auto normal = [](const Vector3d& segment) { return NormalOnSegment(segment); };
  EXPECT_EQ(normal({2, 0, 0}), Vector3d::UnitY());
  EXPECT_EQ(normal({0, 0, -5}), Vector3d::UnitY());
  EXPECT_EQ(normal({0, 3, 0}), Vector3d::UnitX()) << "steep";
  EXPECT_EQ(normal({0, 0, 0}), Vector3d::UnitY()) << "a point is a sphere";
  EXPECT_LE((normal({4, 3, 0}) - Vector3d(-0.6, 0.8, 0)).norm(), 4e-16);
}

TEST(NormalOnSegment, IsAUnitPerpendicularForAnySegment) {
  for (const Vector3d& segment :
       {Vector3d(1, 2, 3), Vector3d(-0.1, 0.95, 0.2), Vector3d(1e-200, 0, 2e-200),
        Vector3d(1e6, -1e6, 1e6), Vector3d(0, 0.9, std::sqrt(0.19))}) {
    const Vector3d n = NormalOnSegment(segment);
    EXPECT_NEAR(n.norm(), 1, 4e-16) << segment.transpose();
    EXPECT_NEAR(n.dot(segment.stableNormalized()), 0, 4e-16) << segment.transpose();
  }
}

// Thin discs, poles, and one that is as long as it is wide; half of the points near the surface.
TEST(CylinderShapes, HaveTheExactDistanceAndNormal) {
  struct Cylinder {
    Vector3d a, b;
    double radius;
  };
  for (const auto& [a, b, radius] :
       {Cylinder{{0, 0, 0}, {0, 1, 0}, 0.5}, Cylinder{{-0.3, 0.2, 0.4}, {0.9, -0.4, 0.1}, 0.02},
        Cylinder{{0.1, 0.1, 0.1}, {0.1, 0.12, 0.09}, 0.7}}) {
    const Collider cylinder = CylinderBetween(a, b, radius);
    test::Random random(5);
    int outside = 0, inside = 0, beyond_rim = 0;
    for (int k = 0; k < 20000; ++k) {
      const double reach = k % 2 == 0 ? 1.5 : 1.5 * radius;
      const Vector3d p =
          a + test::PointInBox(random, Vector3d::Constant(-reach), Vector3d::Constant(reach));
      const test::CylinderPlace exact = test::PlaceAtCylinder(a, b, radius, p);
      const SurfaceDistance surface = SurfaceOf(cylinder, p);
      ASSERT_NEAR(surface.distance_m, exact.distance, 1e-14) << p.transpose();
      (exact.distance < 0 ? inside : outside) += 1;
      if (exact.distance < 0 && exact.lead < 1e-9) continue;
      if (std::abs(exact.distance) < 1e-6) continue;
      ASSERT_LE((surface.outward - exact.outward).norm(), 1e-8) << p.transpose();
      const double along = std::abs(exact.outward.dot((b - a).normalized()));
      beyond_rim += exact.distance > 0 && along > 0.01 && along < 0.99;
    }
    EXPECT_GT(inside, 20);
    EXPECT_GT(outside, 1000);
    EXPECT_GT(beyond_rim, 1000);
  }
}

TEST(CylinderShapes, HaveNormalsWhereTheDistanceHasNoGradient) {
  const Collider cylinder = CylinderBetween({0, -1, 0}, {0, 1, 0}, 0.5);
  const auto outward = [&](const Vector3d& p) { return SurfaceOf(cylinder, p).outward; };
  EXPECT_EQ(outward({0, 0, 0}), Vector3d::UnitX()) << "on the axis: NormalOnSegment";
  EXPECT_EQ(outward({0, 0.75, 0}), Vector3d::UnitY()) << "on the axis, near an end";
  EXPECT_EQ(outward({0, -0.75, 0}), -Vector3d::UnitY());
  EXPECT_EQ(outward({0, 0.75, -0.25}), -Vector3d::UnitZ()) << "of equally near ones the side";
  EXPECT_EQ(outward({0, 1, 0.5}), Vector3d::UnitZ()) << "on the rim";
  const Collider disc = CylinderBetween({0, -0.125, 0}, {0, 0.125, 0}, 0.5);
  EXPECT_EQ(SurfaceOf(disc, {0, 0, 0}).outward, Vector3d::UnitY()) << "halfway: that at b";
  EXPECT_EQ(SurfaceOf(disc, {0, 0, 0}).distance_m, -0.125);
}

TEST(CylinderShapes, GoWithTheirPose) {
  RigidMotion motion = RigidMotion::AtRest({0.1, 0, 0});
  motion.position_m = {1, 2, 3};
  motion.rotation = Eigen::Quaterniond(0.7, -0.3, 0.5, 0.2).normalized();
  const Collider cylinder = CylinderBetween({0.2, 0.1, 0}, {0.4, 0.3, -0.1}, 0.2);
  const Collider moved = Moved(cylinder, motion);
  EXPECT_LE((CentreOf(moved) - motion.PlaceOf(CentreOf(cylinder))).norm(), 4e-15);
  for (const Vector3d& p : {Vector3d(0.3, 0.2, 0.3), Vector3d(0, 0, 0), Vector3d(0.31, 0.2, 0)}) {
    const SurfaceDistance there = SurfaceOf(moved, motion.PlaceOf(p));
    const SurfaceDistance here = SurfaceOf(cylinder, p);
    EXPECT_NEAR(there.distance_m, here.distance_m, 4e-15);
    EXPECT_LE((there.outward - motion.rotation * here.outward).norm(), 1e-14);
  }
}

}  // namespace
}  // namespace drape
