// Where edges and triangles are lowest above solids, against sampling all of them, in both
// precisions.
#include "server/solver/surface_contact/lowest_point.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/surface_contact/lowest_point_test.h"

namespace drape::surface_contact {
namespace {

using self_contact::FromVector;
using test::kConvexKinds;

TYPED_TEST_SUITE(LowestPointTest, Vectors);

TYPED_TEST(LowestPointTest, TheDistanceIsThatOfTheCollider) {
  RandomSolids random(1);
  for (int k = 0; k < 2000; ++k) {
    for (const ShapeKind kind : kConvexKinds) {
      const Collider collider = random.Convex(kind);
      const Solid<TypeParam> solid(collider, kThickness_m);
      const Eigen::Vector3d x = FromVector(ToVector<TypeParam>(random.Point(0.5)));
      EXPECT_NEAR(solid.At(ToVector<TypeParam>(x)).gap, this->GapOf(collider, x),
                  this->kRounding_m);
    }
  }
}

// Moved by its gap along its normal an edge just touches, however deep it was or how far away:
// nothing of it is inside the solid, and something of it is at its surface. An edge that is not
// lowest inside has its lowest place at an end, and the gap is a bound.
TYPED_TEST(LowestPointTest, OfAnEdgeMovedByItsGapTouches) {
  RandomSolids random(2);
  int inside = 0, deep = 0, outside = 0, pierced = 0;
  for (int k = 0; k < 300; ++k) {
    for (const ShapeKind kind : kConvexKinds) {
      const Collider collider = random.Convex(kind);
      const Solid<TypeParam> solid(collider, kThickness_m);
      const TypeParam a = ToVector<TypeParam>(random.Point(0.4));
      const TypeParam b = ToVector<TypeParam>(random.Point(0.4));
      const auto lowest = LowestOnEdge<TypeParam>(solid, a, b, kLeast_m);
      const Eigen::Vector3d p = FromVector(a), q = FromVector(b);
      SCOPED_TRACE(std::string(kShapeNames[static_cast<size_t>(kind)]) + " " + std::to_string(k));
      const double interval = (q - p).norm() / 2000;
      if (!lowest.is_inside) {
        ++outside;
        const double ends = std::min(this->GapOf(collider, p), this->GapOf(collider, q));
        const double all = this->LowestOf(collider, p, q);
        // Or it pierces a plate from face to face.
        const bool is_pierced = all < 0 && all < ends - kLeast_m - this->kRounding_m;
        EXPECT_TRUE(is_pierced || all >= ends - kLeast_m - this->kRounding_m);
        pierced += is_pierced;
        EXPECT_LE(lowest.gap, all + this->kRounding_m);
        continue;
      }
      ++inside;
      deep += lowest.gap < -0.01;
      const Eigen::Vector3d n = FromVector(lowest.normal);
      EXPECT_NEAR(n.norm(), 1, this->kRounding_m);
      EXPECT_NEAR(n.dot(q - p), 0, this->kRounding_m);
      EXPECT_NEAR(lowest.weights[0] + lowest.weights[1], 1, this->kRounding_m);
      const Eigen::Vector3d way = -lowest.gap * n;
      // Convex: between two places of the sample it is lower by half an interval at most, where the
      // surface has an edge.
      const double touching = this->LowestOf(collider, p + way, q + way);
      EXPECT_GE(touching, -this->kRounding_m);
      // Deep inside a round solid the tangents that are as low at the edge touch it in places
      // apart.
      const double apart = lowest.gap < -0.002 ? -lowest.gap / 2 : 0;
      // What is lowest beyond an end, in the overlap, is as much higher at the end.
      const double overlap = kOverlap * (q - p).norm();
      EXPECT_LE(touching, kLeast_m + interval + apart + overlap + this->kRounding_m) << lowest.gap;
    }
  }
  EXPECT_LT(pierced, 0.06 * outside);
  EXPECT_GT(inside, 100);
  EXPECT_GT(deep, 30);
  EXPECT_GT(outside, 100);
}

// The same of triangles. Below kLeastWeight of a height from the rim a corner of a solid counts as
// beside the triangle.
TYPED_TEST(LowestPointTest, OfATriangleMovedByItsGapTouches) {
  RandomSolids random(3);
  int inside = 0, deep = 0;
  for (int k = 0; k < 300; ++k) {
    for (const ShapeKind kind : kConvexKinds) {
      const Collider collider = random.Convex(kind);
      const Solid<TypeParam> solid(collider, kThickness_m);
      std::array<TypeParam, 3> corners;
      std::array<Eigen::Vector3d, 3> exact;
      for (size_t c = 0; c < 3; ++c) {
        corners[c] = ToVector<TypeParam>(random.Point(0.5));
        exact[c] = FromVector(corners[c]);
      }
      const double height =
          (exact[1] - exact[0]).cross(exact[2] - exact[0]).norm() / (exact[1] - exact[0]).norm();
      if (height < 0.05) continue;
      const auto lowest = LowestOnTriangle<TypeParam>(solid, corners, kLeast_m);
      SCOPED_TRACE(std::string(kShapeNames[static_cast<size_t>(kind)]) + " " + std::to_string(k));
      const double all = this->LowestOf(collider, exact);
      const double interval = 1.0 / 100;
      if (!lowest.is_inside) {
        // Deep inside, the nearest face need not be that in whose direction the triangle is.
        if (all > 0) {
          EXPECT_GE(all, this->RimOf(collider, exact) - kLeastWeight - interval);
        }
        continue;
      }
      ++inside;
      deep += lowest.gap < -0.01;
      const Eigen::Vector3d n = FromVector(lowest.normal);
      const Eigen::Vector3d way = -lowest.gap * n;
      std::array<Eigen::Vector3d, 3> moved = exact;
      for (Eigen::Vector3d& corner : moved) corner += way;
      const double touching = this->LowestOf(collider, moved);
      // What is level to kLevelSlope, of solids below half a metre, is taken for level.
      EXPECT_GE(touching, -kLevelSlope / 4 * 0.5 - this->kRounding_m);
      EXPECT_LE(touching, interval + kOverlap + this->kRounding_m);
    }
  }
  EXPECT_GT(inside, 100);
  EXPECT_GT(deep, 20);
}

// A triangle across the edge of a box, which ends in a corner under it: whether it tilts a little
// to one side or to the other, there is a plane at that corner.
TYPED_TEST(LowestPointTest, ATriangleThatTiltsOverAnEdgeHasTheCorner) {
  RandomSolids random(5);
  std::vector<TypeParam> corners_of_solid;
  for (int k = 0; k < 100; ++k) {
    const Eigen::Quaterniond turn = random.Rotation();
    const Eigen::Vector3d half(0.1, 0.15, 0.2), centre = random.Point(0.2);
    const Solid<TypeParam> solid(BoxAt(centre, half, turn), kThickness_m);
    const Eigen::Vector3d corner = centre + turn * half;
    for (const double slope : {-0.05, -0.01, 0.01, 0.05}) {
      const Eigen::Vector3d n =
          turn * Eigen::Vector3d(1, random.Between(0.5, 2), slope).normalized();
      const double gap = random.Between(-0.001, 0.004);
      const auto corners = TriangleAround<TypeParam>(random, corner + (gap + kThickness_m) * n, n);
      LowestPoint<TypeParam> lowest = LowestOnTriangle<TypeParam>(solid, corners, kLeast_m);
      SCOPED_TRACE(std::to_string(k) + " " + std::to_string(slope));
      EXPECT_EQ(lowest.is_inside, slope > 0);
      if (!lowest.is_inside) {
        EXPECT_LE(lowest.gap, gap + this->kRounding_m) << "nothing is nearer";
        lowest = LowestCornerUnder<TypeParam>(solid, corners, lowest.normal, corners_of_solid);
      }
      ASSERT_TRUE(lowest.is_inside);
      EXPECT_NEAR(lowest.gap, gap, 10 * this->kRounding_m);
      EXPECT_NEAR((FromVector(lowest.normal) - n).norm(), 0, 10 * this->kRounding_m);
      EXPECT_NEAR(lowest.weights[1], 1.0 / 3, 100 * this->kRounding_m);
    }
  }
}

// The same beside a capsule whose lower end is under the triangle and whose other end is far above
// it. Tilted farther than kNearlyLevel to the far end, it has none.
TYPED_TEST(LowestPointTest, ATriangleThatTiltsBesideACapsuleHasItsEnd) {
  RandomSolids random(7);
  std::vector<TypeParam> corners_of_solid;
  for (int k = 0; k < 100; ++k) {
    const Eigen::Vector3d axis = random.Point(1).normalized(), end = random.Point(0.1);
    const double radius = random.Between(0.01, 0.05);
    const Solid<TypeParam> solid(CapsuleBetween(end, end + 0.4 * axis, radius), kThickness_m);
    const Eigen::Vector3d side = axis.unitOrthogonal();
    for (const double slope : {-0.05, -0.01, 0.01, 0.05, 0.2}) {
      const Eigen::Vector3d n = (side + slope * axis).normalized();
      const double gap = random.Between(-0.001, 0.004);
      const auto corners =
          TriangleAround<TypeParam>(random, end + (gap + radius + kThickness_m) * n, n);
      LowestPoint<TypeParam> lowest = LowestOnTriangle<TypeParam>(solid, corners, kLeast_m);
      SCOPED_TRACE(std::to_string(k) + " " + std::to_string(slope));
      EXPECT_EQ(lowest.is_inside, slope < 0);
      if (!lowest.is_inside) {
        EXPECT_LE(lowest.gap, gap + this->kRounding_m) << "nothing is nearer";
        lowest = LowestCornerUnder<TypeParam>(solid, corners, lowest.normal, corners_of_solid);
      }
      ASSERT_EQ(lowest.is_inside, slope < kNearlyLevel);
      if (!lowest.is_inside) continue;
      EXPECT_NEAR(lowest.gap, gap, 10 * this->kRounding_m);
      EXPECT_NEAR((FromVector(lowest.normal) - n).norm(), 0, 10 * this->kRounding_m);
      EXPECT_NEAR(lowest.weights[1], 1.0 / 3, 100 * this->kRounding_m);
    }
  }
}

// Beside a round solid a triangle is not lowest inside until a corner has used up the room: many of
// these are nearly parallel to a capsule, whose farthest end changes there.
TYPED_TEST(LowestPointTest, InItsRoomNoTriangleBesideARoundSolidIsLowestInside) {
  RandomSolids random(8);
  int rooms = 0;
  for (int k = 0; k < 20000; ++k) {
    const Eigen::Vector3d axis = random.Point(1).normalized(), end = random.Point(0.1);
    const double radius = random.Between(0.01, 0.05);
    const Collider collider =
        k % 4 == 0 ? SphereAt(end, radius) : CapsuleBetween(end, end + 0.4 * axis, radius);
    const Solid<TypeParam> solid(collider, kThickness_m);
    const Eigen::Vector3d side = axis.unitOrthogonal(), across = axis.cross(side);
    const Eigen::Vector3d middle =
        end + random.Between(0, 0.4) * axis + (radius + random.Between(0, 0.02)) * side;
    std::array<TypeParam, 3> corners;
    for (TypeParam& corner : corners) {
      corner = ToVector<TypeParam>(middle + random.Between(-0.1, 0.1) * axis +
                                   random.Between(-0.1, 0.1) * across +
                                   random.Between(-0.01, 0.01) * side);
    }
    const auto lowest = LowestOnTriangle<TypeParam>(solid, corners, kLeast_m);
    if (lowest.is_inside || lowest.room <= 1e-4) continue;
    ++rooms;
    for (int tries = 0; tries < 20; ++tries) {
      std::array<TypeParam, 3> moved = corners;
      for (TypeParam& corner : moved) {
        corner += ToVector<TypeParam>(0.999 * lowest.room * random.Point(1).normalized());
      }
      EXPECT_FALSE(LowestOnTriangle<TypeParam>(solid, moved, kLeast_m).is_inside) << k;
    }
  }
  EXPECT_GT(rooms, 2000);
}

// An edge from above a face to beyond its end: that comes down next, where it leaves the face,
// whether the edge rises a little or not. The box is behind the plane.
TYPED_TEST(LowestPointTest, AnEdgeThatRisesALittleLeavesItsFaceThere) {
  RandomSolids random(6);
  for (int k = 0; k < 100; ++k) {
    const Eigen::Quaterniond turn = random.Rotation();
    const Eigen::Vector3d half(0.2, 0.1, 0.2), centre = random.Point(0.2);
    const Solid<TypeParam> solid(BoxAt(centre, half, turn), kThickness_m);
    const double height = random.Between(0, 0.002), length = random.Between(0.25, 0.35);
    for (const double slope : {-0.04, 0.0, 0.04, 0.5}) {
      const auto place = [&](double x) {
        return Eigen::Vector3d(
            centre + turn * Eigen::Vector3d(x, 0.1 + kThickness_m + height + slope * x, 0));
      };
      const TypeParam a = ToVector<TypeParam>(place(0)), b = ToVector<TypeParam>(place(length));
      SCOPED_TRACE(std::to_string(k) + " " + std::to_string(slope));
      LowestPoint<TypeParam> lowest = LowestOnEdge<TypeParam>(solid, a, b, kLeast_m);
      EXPECT_EQ(lowest.is_inside, slope < 0);
      if (!lowest.is_inside) lowest = NextOnEdge<TypeParam>(solid, a, b, kLeast_m);
      ASSERT_EQ(lowest.is_inside, slope < 0.1);
      if (!lowest.is_inside) continue;
      // Beyond the face the distance rounds off, over some times the thickness.
      EXPECT_NEAR(lowest.weights[1] * length, half.x(), 2 * kThickness_m);
      EXPECT_NEAR(lowest.gap, height + slope * half.x(), 2 * kThickness_m * kNearlyLevel);
      const Eigen::Vector3d n = FromVector(lowest.normal);
      const double level = n.dot(place(lowest.weights[1] * length)) - lowest.gap;
      for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3d local((corner & 1) != 0 ? half.x() : -half.x(),
                                    (corner & 2) != 0 ? half.y() : -half.y(),
                                    (corner & 4) != 0 ? half.z() : -half.z());
        EXPECT_LE(n.dot(centre + turn * local) + kThickness_m, level + 2 * kLeast_m);
      }
    }
  }
}

// What is clear of a solid, however thin that is, is not pushed: its plane may cut the solid beside
// the triangle, but then nothing of it is under the triangle on the other side.
TYPED_TEST(LowestPointTest, ATriangleThatIsClearIsNotPushed) {
  RandomSolids random(9);
  int clear = 0, planes = 0;
  for (int k = 0; k < 3000; ++k) {
    const double thin = random.Between(0.001, 0.02);
    const Eigen::Vector3d centre = random.Point(0.1), axis = random.Point(1).normalized();
    const std::array<Collider, 3> solids{
        BoxAt(centre, {thin, random.Between(0.05, 0.2), 0.2}, random.Rotation()),
        CapsuleBetween(centre, centre + 0.4 * axis, thin),
        CylinderBetween(centre, centre + thin * axis, random.Between(0.05, 0.2))};
    std::array<TypeParam, 3> corners;
    std::array<Eigen::Vector3d, 3> exact;
    const Eigen::Vector3d middle = centre + random.Point(0.2);
    for (size_t c = 0; c < 3; ++c) {
      corners[c] = ToVector<TypeParam>(middle + random.Point(0.1));
      exact[c] = FromVector(corners[c]);
    }
    for (const Collider& collider : solids) {
      const Solid<TypeParam> solid(collider, kThickness_m);
      const double interval = 0.2 / 40;
      if (this->LowestOf(collider, exact, 40) < interval) continue;
      ++clear;
      const auto lowest = LowestOnTriangle<TypeParam>(solid, corners, kLeast_m);
      if (!lowest.is_inside) continue;
      ++planes;
      EXPECT_GE(lowest.gap, -this->kRounding_m) << k << " " << static_cast<int>(collider.kind());
    }
  }
  EXPECT_GT(clear, 1000);
  EXPECT_GT(planes, 100);
}

// Above a face nothing is lowest inside until a corner has used up the room.
TYPED_TEST(LowestPointTest, InTheRoomAboveAFaceNothingIsLowestInside) {
  RandomSolids random(4);
  int rooms = 0;
  for (int k = 0; k < 20000; ++k) {
    const ShapeKind kind = k % 2 == 0 ? ShapeKind::kBox : ShapeKind::kCylinder;
    const Collider collider = random.Convex(kind);
    const Solid<TypeParam> solid(collider, kThickness_m);
    const Eigen::Vector3d middle = random.Point(0.3);
    std::array<TypeParam, 3> corners;
    for (TypeParam& corner : corners) {
      corner = ToVector<TypeParam>(middle + random.Point(0.05));
    }
    const double room = solid.RoomAboveFace(corners);
    if (room <= 1e-4) continue;
    ++rooms;
    for (TypeParam& corner : corners) {
      corner += ToVector<TypeParam>(0.999 * room * random.Point(1).normalized());
    }
    EXPECT_FALSE(LowestOnEdge<TypeParam>(solid, corners[0], corners[1], kLeast_m).is_inside);
    std::array<Eigen::Vector3d, 3> exact;
    for (size_t c = 0; c < 3; ++c) exact[c] = FromVector(corners[c]);
    EXPECT_GE(this->LowestOf(collider, exact, 12),
              std::min({this->GapOf(collider, exact[0]), this->GapOf(collider, exact[1]),
                        this->GapOf(collider, exact[2])}) -
                  this->kRounding_m);
  }
  EXPECT_GT(rooms, 200);
}

// Where a path meets a solid, against trying it place by place.
TYPED_TEST(LowestPointTest, APathMeetsWhereItFirstGoesIn) {
  RandomSolids random(6);
  int meets = 0;
  for (int k = 0; k < 1500; ++k) {
    for (const ShapeKind kind : kConvexKinds) {
      const Collider collider = random.Convex(kind);
      const Solid<TypeParam> solid(collider, kThickness_m);
      const TypeParam a = ToVector<TypeParam>(random.Point(0.6));
      const TypeParam b = ToVector<TypeParam>(random.Point(0.6));
      const Eigen::Vector3d p = FromVector(a), q = FromVector(b);
      if (this->GapOf(collider, p) <= 0) continue;
      const double lowest = this->LowestOf(collider, p, q, 500);
      const double interval = (q - p).norm() / 500;
      TypeParam place{}, normal{};
      const bool is_met = Meets<TypeParam>(solid, a, b, place, normal);
      SCOPED_TRACE(std::string(kShapeNames[static_cast<size_t>(kind)]) + " " + std::to_string(k));
      EXPECT_FALSE(is_met && lowest > 1e-3 * (q - p).norm());
      EXPECT_TRUE(is_met || lowest >= -interval);
      if (!is_met) continue;
      ++meets;
      EXPECT_NEAR(this->GapOf(collider, FromVector(place)), 0, 1e-5 + this->kRounding_m);
      EXPECT_LE(FromVector(normal).dot(q - p), 0);
    }
  }
  EXPECT_GT(meets, 500);
}

// Where the inside of an edge meets a solid on its way, against trying it time by time. What it
// slides along it may miss between two looks, but hardly ever.
TYPED_TEST(LowestPointTest, AnEdgeMeetsWhereItFirstTouches) {
  using Scalar = ScalarOf<TypeParam>;
  constexpr Scalar kLeast = 1e-4f;
  constexpr int kTimes = 300;
  RandomSolids random(8);
  int meets = 0, missed = 0;
  for (int k = 0; k < 600; ++k) {
    for (const ShapeKind kind : kConvexKinds) {
      const Collider collider = random.Convex(kind);
      const Solid<TypeParam> solid(collider, kThickness_m);
      std::array<TypeParam, 2> starts, ends;
      for (TypeParam& x : starts) x = ToVector<TypeParam>(random.Point(0.6));
      for (TypeParam& x : ends) x = ToVector<TypeParam>(random.Point(0.6));
      const auto at = [&](Scalar along) {
        return LowestOnEdge(solid, TypeParam(starts[0] + along * (ends[0] - starts[0])),
                            TypeParam(starts[1] + along * (ends[1] - starts[1])), kLeast);
      };
      const LowestPoint<TypeParam> first = at(0);
      if (first.gap <= 0) continue;
      bool touches = false, is_deep = false;
      for (int t = 0; t <= kTimes; ++t) {
        const LowestPoint<TypeParam> lowest = at(static_cast<Scalar>(t) / kTimes);
        touches |= lowest.is_inside && lowest.gap <= Scalar{0.01f};
        is_deep |= lowest.is_inside && lowest.gap < Scalar{-0.02f};
      }
      LowestPoint<TypeParam> lowest;
      const bool is_met = MeetsEdge<TypeParam>(solid, starts, ends, kLeast, lowest);
      EXPECT_FALSE(is_met && !touches) << k;
      missed += is_deep && !is_met;
      meets += is_met;
      if (is_met) {
        EXPECT_LE(lowest.gap, kLeast);
      }
    }
  }
  EXPECT_GT(meets, 200);
  EXPECT_LE(100 * missed, meets);
}

}  // namespace
}  // namespace drape::surface_contact
