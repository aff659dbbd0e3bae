#include "server/scene/rigid_motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "server/scene/colliders.h"

namespace drape {
namespace {

using Eigen::Vector3d;

// A body of size 1 at some 3 m: a few roundings of that.
constexpr double kRounding = 64 * 0x1p-53;

RigidMotion SomeMotion() {
  RigidMotion motion = RigidMotion::AtRest(Vector3d(0.5, -1, 2));
  motion.position_m = Vector3d(1, 2, -1);
  motion.rotation = Eigen::AngleAxisd(0.8, Vector3d(0.6, 0, 0.8));
  motion.velocity_m_per_s = Vector3d(0.25, -0.5, 1);
  motion.angular_velocity_rad_per_s = Vector3d(-0.3, 0.4, 1.2);
  return motion;
}

TEST(RigidMotion, DescribedPointsAreWhereTheyWereDescribedWhileItRests) {
  const RigidMotion resting = RigidMotion::AtRest(Vector3d(0.5, -1, 2));
  const Vector3d point(3, 4, 5);
  EXPECT_EQ(resting.PlaceOf(point), point);
  EXPECT_EQ(resting.After(7).PlaceOf(point), point);
  EXPECT_EQ(resting.VelocityAt(point), Vector3d::Zero());
}

TEST(RigidMotion, PlacesAndDescriptionsAreInverse) {
  const RigidMotion motion = SomeMotion();
  const Vector3d point(0.3, -0.6, 2.2);
  EXPECT_LE((motion.DescribedAt(motion.PlaceOf(point)) - point).norm(), kRounding);
  EXPECT_EQ(motion.PlaceOf(motion.pivot_m), motion.position_m);
}

// Halves add up, distances stay, and the velocity is the derivative: central differences are off by
// |w|^3 dt^2 / 6.
TEST(RigidMotion, MovesRigidlyWithItsVelocities) {
  const RigidMotion motion = SomeMotion();
  const Vector3d a(0.3, -0.6, 2.2), b(-0.4, 0.1, 1.5);
  EXPECT_LE((motion.After(1.4).PlaceOf(a) - motion.After(0.5).After(0.9).PlaceOf(a)).norm(),
            kRounding);
  const RigidMotion later = motion.After(1.4);
  EXPECT_NEAR((later.PlaceOf(a) - later.PlaceOf(b)).norm(), (a - b).norm(), kRounding);
  constexpr double kStep = 1e-4;
  const Vector3d moved = motion.After(kStep).PlaceOf(a) - motion.After(-kStep).PlaceOf(a);
  EXPECT_LE((moved / (2 * kStep) - motion.VelocityAt(motion.PlaceOf(a))).norm(),
            std::pow(1.3, 3) * kStep * kStep + kRounding / kStep);
}

TEST(RigidMotion, GoesToAPoseTheShorterWay) {
  const RigidMotion start = SomeMotion();
  RigidMotion goal = start;
  goal.position_m = Vector3d(-1, 0, 1);
  // The same rotation as 0.3 the other way.
  goal.rotation = Eigen::AngleAxisd(2 * M_PI - 0.3, Vector3d::UnitY()) * start.rotation;
  const RigidMotion way = start.Towards(goal, 0.5);
  EXPECT_LE((way.angular_velocity_rad_per_s - Vector3d(0, -0.6, 0)).norm(), kRounding);
  const RigidMotion there = way.After(0.5);
  EXPECT_LE((there.position_m - goal.position_m).norm(), kRounding);
  EXPECT_LE(there.rotation.angularDistance(goal.rotation), std::sqrt(kRounding));
  EXPECT_EQ(start.Towards(start, 1).angular_velocity_rad_per_s, Vector3d::Zero());
}

TEST(RigidMotion, ChordsAreTheWayOfAPointOverTime) {
  for (const double seconds : {1e-4, 0.3, 2.0}) {
    const RigidMotion motion = SomeMotion();
    const ChordFactors chord = motion.ChordOver(seconds);
    const Vector3d place = motion.PlaceOf(Vector3d(0.3, -0.6, 2.2));
    const Vector3d tangent = motion.angular_velocity_rad_per_s.cross(place - motion.position_m);
    const Vector3d mean = motion.velocity_m_per_s + chord.sine * tangent +
                          chord.cosine_s * motion.angular_velocity_rad_per_s.cross(tangent);
    const Vector3d later = motion.After(seconds).PlaceOf(motion.DescribedAt(place));
    EXPECT_LE((mean * seconds - (later - place)).norm(), kRounding) << seconds;
  }
  EXPECT_EQ(RigidMotion::AtRest(Vector3d::Zero()).ChordOver(0.5).cosine_s, 0.25);
}

TEST(MovedColliders, AreTheShapesWhereTheMotionHasThem) {
  const RigidMotion motion = SomeMotion();
  const Collider sphere = Moved(SphereAt({1, 2, 3}, 0.5), motion);
  EXPECT_EQ(sphere.pose.position_m, motion.PlaceOf(Vector3d(1, 2, 3)));
  const Collider plane = Moved(PlaneThrough({0, 0, 0}, {0, 1, 0}), motion);
  EXPECT_EQ(SurfaceOf(plane, {1, 2, 3}).outward, motion.rotation * Vector3d::UnitY());
  const Collider capsule = Moved(CapsuleBetween({1, 0, 0}, {0, 1, 0}, 0.2), motion);
  const Vector3d a = motion.PlaceOf({1, 0, 0}), b = motion.PlaceOf({0, 1, 0});
  EXPECT_LE((NumbersOf(capsule).point_m - a).norm(), kRounding);
  EXPECT_LE((NumbersOf(capsule).vector - (b - a)).norm(), kRounding);
  EXPECT_LE((CentreOf(capsule) - (a + b) / 2).norm(), kRounding);
  const Collider box = Moved(BoxAt({1, 0, 0}, {1, 2, 3}), motion);
  EXPECT_TRUE(box.pose.rotation.isApprox(motion.rotation));
}

}  // namespace
}  // namespace drape
