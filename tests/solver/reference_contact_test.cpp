// Distance and normal of capsules and boxes: closed forms at chosen points, and properties of every
// signed distance at random points.
#include "server/solver/cpu_reference/reference_contact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace drape {
namespace {

using Eigen::Vector3d;

// Roundings of numbers near 1.
constexpr double kFewUlps = 16 * 0x1p-53;

void ExpectContact(const Collider& collider, const Vector3d& q, double gap,
                   const Vector3d& normal) {
  const ReferenceContact contact = ContactAt(collider, 0, q);
  EXPECT_NEAR(contact.gap, gap, kFewUlps) << "at " << q.transpose();
  EXPECT_LE((contact.normal - normal).norm(), kFewUlps)
      << "at " << q.transpose() << ": " << contact.normal.transpose();
}

TEST(ReferenceCapsule, BesideTheSegmentAndBeyondItsEnds) {
  const Collider capsule = CapsuleBetween({-1, 0.5, 2}, {3, 0.5, 2}, 0.25);
  ExpectContact(capsule, {0.7, 1.5, 2}, 0.75, Vector3d::UnitY());
  ExpectContact(capsule, {2.9, 0.5, 1.9}, -0.15, -Vector3d::UnitZ());  // inside
  ExpectContact(capsule, {-3, 0.5, 2}, 1.75, -Vector3d::UnitX());
  ExpectContact(capsule, {3.3, 0.5, 2.4}, 0.25, Vector3d(0.6, 0, 0.8));  // round end
  EXPECT_NEAR(ContactAt(capsule, 0.125, {0.7, 1.5, 2}).gap, 0.625, kFewUlps);
}

TEST(ReferenceCapsule, OnTheSegmentAFixedPerpendicularPushes) {
  for (const double x : {-1.0, 0.25, 3.0}) {
    ExpectContact(CapsuleBetween({-1, 0.5, 2}, {3, 0.5, 2}, 0.25), {x, 0.5, 2}, -0.25,
                  Vector3d::UnitY());
  }
  ExpectContact(CapsuleBetween({0, -1, 0}, {0, 1, 0}, 0.5), {0, 0.5, 0}, -0.5, Vector3d::UnitX());
}

TEST(ReferenceCapsule, OfLengthZeroIsASphere) {
  const Vector3d center(0.25, -0.5, 1);
  const Collider capsule = CapsuleBetween(center, center, 0.5);
  const Collider sphere = SphereAt(center, 0.5);
  for (const Vector3d& q : {center, Vector3d(1, 1, 1), Vector3d(0.3, -0.5, 1)}) {
    EXPECT_EQ(ContactAt(capsule, 0.1, q).gap, ContactAt(sphere, 0.1, q).gap);
    EXPECT_EQ(ContactAt(capsule, 0.1, q).normal, ContactAt(sphere, 0.1, q).normal);
  }
}

Collider SmallBox() {
  return BoxAt({1, 2, 3}, {0.5, 0.25, 1});
}

TEST(ReferenceBox, OutsideFromTheNearestPoint) {
  const Collider box = SmallBox();
  ExpectContact(box, {1.25, 3, 2.5}, 0.75, Vector3d::UnitY());
  ExpectContact(box, {0, 1.9, 3.5}, 0.5, -Vector3d::UnitX());
  ExpectContact(box, {1.8, 1.35, 3}, 0.5, Vector3d(0.6, -0.8, 0));           // edge
  ExpectContact(box, {1.7, 2.45, 4.1}, 0.3, Vector3d(0.2, 0.2, 0.1) / 0.3);  // corner
  ExpectContact(box, {1.5, 2.25, 4}, 0, Vector3d::UnitX());                  // on the corner
  EXPECT_NEAR(ContactAt(box, 0.1, {1.8, 1.35, 3}).gap, 0.4, kFewUlps);
}

TEST(ReferenceBox, InsideTheNearestFace) {
  const Collider box = SmallBox();
  ExpectContact(box, {1.1, 1.9, 3.2}, -0.15, -Vector3d::UnitY());
  ExpectContact(box, {1.45, 2, 3.2}, -0.05, Vector3d::UnitX());
  ExpectContact(box, {1.1, 2, 2.1}, -0.1, -Vector3d::UnitZ());
}

TEST(ReferenceBox, OfEquallyNearFacesTheFirst) {
  ExpectContact(SmallBox(), {1, 2, 3}, -0.25, Vector3d::UnitY());  // the centre: +y before -y
  const Collider cube = BoxAt({0, 0, 0}, {1, 1, 1});
  ExpectContact(cube, {0, 0, 0}, -1, Vector3d::UnitX());
  ExpectContact(cube, {0.25, 0.5, -0.5}, -0.5, Vector3d::UnitY());
  ExpectContact(cube, {-0.5, 0.25, -0.5}, -0.5, -Vector3d::UnitX());
}

// A quarter turn about z takes x to y and y to -x.
TEST(ReferenceBox, TurnsWithItsRotation) {
  Collider box = SmallBox();
  box.pose.rotation = Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitZ());
  ExpectContact(box, {1, 3, 3}, 0.5, Vector3d::UnitY());
  ExpectContact(box, {0, 2, 3}, 0.75, -Vector3d::UnitX());
  ExpectContact(box, {1.1, 2.2, 3}, -0.15, Vector3d::UnitX());
}

// Difference quotients of the distance in every direction.
Vector3d Gradient(const Collider& collider, const Vector3d& q, double step) {
  Vector3d gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d d = step * Vector3d::Unit(axis);
    gradient[axis] =
        (ContactAt(collider, 0, q + d).gap - ContactAt(collider, 0, q - d).gap) / (2 * step);
  }
  return gradient;
}

// The gradient of the distance is the normal where it is smooth, and the point at that distance
// back along the normal is on the surface, inside and outside.
void ExpectSignedDistance(const Collider& collider) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate(-1.5, 1.5);
  constexpr double kStep = 1e-5;
  constexpr int kPoints = 4000;
  int smooth_points = 0, inner_points = 0;
  for (int k = 0; k < kPoints; ++k) {
    const Vector3d q(coordinate(random), coordinate(random), coordinate(random));
    const ReferenceContact contact = ContactAt(collider, 0, q);
    EXPECT_NEAR(contact.normal.norm(), 1, kFewUlps);
    inner_points += contact.gap < 0;
    EXPECT_NEAR(ContactAt(collider, 0, q - contact.gap * contact.normal).gap, 0, kFewUlps)
        << "at " << q.transpose();
    // Curved within a few steps (beside an edge or a segment) or kinked (between two faces).
    const double reach = 1000 * kStep;
    bool is_smooth = true;
    for (int axis = 0; axis < 3; ++axis) {
      for (const double move : {-reach, reach}) {
        const Vector3d n = ContactAt(collider, 0, q + move * Vector3d::Unit(axis)).normal;
        is_smooth = is_smooth && (n - contact.normal).norm() < 0.1;
      }
    }
    if (!is_smooth) continue;
    ++smooth_points;
    // The normal turns by less than 0.1 over `reach`, so by 1e-4 over a step; the central
    // difference is off by at most half of that squared, and by rounding over the step.
    const Vector3d gradient = Gradient(collider, q, kStep);
    EXPECT_LE((gradient - contact.normal).norm(), 1e-4) << "at " << q.transpose();
    EXPECT_NEAR(gradient.norm(), 1, 1e-7) << "at " << q.transpose();
  }
  EXPECT_GT(smooth_points, kPoints * 3 / 4);
  EXPECT_GT(inner_points, kPoints / 50);
}

TEST(ReferenceCapsule, DistanceHasTheNormalAsItsGradient) {
  ExpectSignedDistance(CapsuleBetween({-0.8, -0.3, 0.1}, {0.6, 0.7, -0.4}, 0.3));
}

TEST(ReferenceCylinder, SideEndsAndRim) {
  const Collider cylinder = CylinderBetween({-1, 0.5, 2}, {3, 0.5, 2}, 0.25);
  ExpectContact(cylinder, {0.7, 1.5, 2}, 0.75, Vector3d::UnitY());
  ExpectContact(cylinder, {-3, 0.5, 2}, 2, -Vector3d::UnitX());
  ExpectContact(cylinder, {-1.5, 0.6, 2.1}, 0.5, -Vector3d::UnitX());  // above an end
  ExpectContact(cylinder, {3.3, 0.5, 2.65}, 0.5, Vector3d(0.6, 0, 0.8));
  ExpectContact(cylinder, {1, 0.5, 1.9}, -0.15, -Vector3d::UnitZ());
  ExpectContact(cylinder, {2.95, 0.6, 2}, -0.05, Vector3d::UnitX());
}

TEST(ReferenceCylinder, DistanceHasTheNormalAsItsGradient) {
  ExpectSignedDistance(CylinderBetween({-0.8, -0.3, 0.1}, {0.6, 0.7, -0.4}, 0.4));
}

TEST(ReferenceBox, DistanceHasTheNormalAsItsGradient) {
  ExpectSignedDistance(BoxAt({0.1, -0.2, 0.05}, {0.8, 0.3, 0.5},
                             Eigen::Quaterniond(0.7, -0.3, 0.5, 0.2).normalized()));
}

}  // namespace
}  // namespace drape
