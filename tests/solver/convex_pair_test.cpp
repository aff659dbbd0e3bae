// Random pairs of convex solids against projections onto each of the two in turn, which know
// nothing of axes or outlines (server/solver/bodies/convex_pair.h).
#include "server/solver/bodies/convex_pair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <utility>
#include <variant>
#include <vector>

#include "server/scene/distance_map.h"
#include "tests/support/solids/solids.h"

namespace drape::bodies {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
constexpr double kFar = 10;

class Random {
 public:
  explicit Random(unsigned seed) : random_(seed) {}

  double Between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Vector3d Direction() {
    for (;;) {
      const Vector3d v(Between(-1, 1), Between(-1, 1), Between(-1, 1));
      if (v.norm() > 0.1 && v.norm() < 1) return v.normalized();
    }
  }
  // A tetrahedron, octahedron, wedge or cube, stretched and sheared.
  Collider Polytope() {
    TriangleMesh mesh;
    switch (std::uniform_int_distribution(0, 3)(random_)) {
      case 0:
        mesh.positions_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
        break;
      case 1:
        mesh.positions_m = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
        mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                          {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
        break;
      case 2:
        mesh.positions_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
        mesh.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3},
                          {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};
        break;
      default:
        mesh = test::BoxMesh(Vector3d::Zero(), Vector3d::Ones());
    }
    const Vector3d sizes(Between(0.05, 0.2), Between(0.05, 0.2), Between(0.05, 0.2));
    Eigen::Matrix3d change = sizes.asDiagonal();
    if (Between(0, 1) < 0.7) {
      change(0, 1) = Between(-0.05, 0.05);
      change(1, 2) = Between(-0.05, 0.05);
      change = Quaterniond::FromTwoVectors(Vector3d::UnitX(), Direction()) * change;
    }
    for (Vector3d& p : mesh.positions_m) p = change * p;
    DistanceMapSettings coarse;
    coarse.resolution = 4;
    return DistanceMapAt(DistanceMap::Build(mesh, coarse).value());
  }
  // Half of the boxes lie along the axes, where edges and faces are parallel.
  Collider Solid(ShapeKind kind) {
    if (kind == ShapeKind::kDistanceMap) return Polytope();
    const double length = Between(0.02, 0.2), width = Between(0.02, 0.1);
    const Vector3d way = Between(0, 1) < 0.5 ? Vector3d(Vector3d::UnitX()) : Direction();
    if (kind == ShapeKind::kCapsule) return CapsuleBetween(-length * way, length * way, width);
    if (kind == ShapeKind::kCylinder) return CylinderBetween(-length * way, length * way, width);
    const Quaterniond turned = Between(0, 1) < 0.5
                                   ? Quaterniond::Identity()
                                   : Quaterniond::FromTwoVectors(Vector3d::UnitX(), Direction());
    return BoxAt(Vector3d::Zero(), {length, width, Between(0.02, 0.2)}, turned);
  }

 private:
  std::mt19937 random_;
};

struct Pair {
  Pair(const Collider& a, const Collider& b, const Vector3d& way) {
    first.collider = &a;
    second.collider = &b;
    first.motion = first.start = first.end = RigidMotion::AtRest(Vector3d::Zero());
    second.motion = second.start = second.end = RigidMotion::AtRest(Vector3d::Zero());
    Shift(way);
  }
  void Shift(const Vector3d& way) {
    first.start.position_m += way;
    first.end = first.start;
  }

  PlacedCollider first;
  PlacedCollider second;
};

Vector3d Projected(const PlacedCollider& solid, const Vector3d& p) {
  const SurfaceDistance surface = solid.SurfaceAtEnd(p);
  return p - std::max(surface.distance_m, 0.0) * surface.outward;
}

// Projections onto two convex sets in turn come to their nearest points, or to one that they share
// (Cheney and Goldstein 1959), from above.
double ProjectedDistance(const Pair& pair) {
  Vector3d p = pair.first.end.position_m;
  double distance = 0;
  for (int round = 0; round < 5000; ++round) {
    const Vector3d on_second = Projected(pair.second, p);
    const Vector3d on_first = Projected(pair.first, on_second);
    distance = (on_second - on_first).norm();
    if (distance < 1e-12 || (on_first - p).norm() < 1e-14) break;
    p = on_first;
  }
  return distance;
}

// The signed distance of a convex solid is convex along a segment.
double DistanceAlong(const PlacedCollider& capsule, const PlacedCollider& other) {
  const auto& shape = std::get<CapsuleShape>(capsule.collider->shape);
  const Vector3d a = capsule.end.PlaceOf(shape.a_m), b = capsule.end.PlaceOf(shape.b_m);
  double low = 0, high = 1;
  const auto at = [&](double share) {
    return other.SurfaceAtEnd(a + share * (b - a)).distance_m - shape.radius_m;
  };
  for (int round = 0; round < 100; ++round) {
    const double third = (high - low) / 3;
    if (at(low + third) < at(high - third)) {
      high -= third;
    } else {
      low += third;
    }
  }
  return at(low);
}

bool IsCapsule(const PlacedCollider& solid) {
  return solid.collider->kind() == ShapeKind::kCapsule;
}

// Exact with a capsule, where it may be negative; of others never too small.
double DistanceOf(const Pair& pair) {
  if (IsCapsule(pair.first)) return DistanceAlong(pair.first, pair.second);
  if (IsCapsule(pair.second)) return DistanceAlong(pair.second, pair.first);
  return ProjectedDistance(pair);
}

bool IsFlat(const PlacedCollider& solid) {
  return solid.collider->kind() == ShapeKind::kBox || MapOf(*solid.collider);
}

// Normals and offsets; bodies of this test shift, but do not turn.
void AddPlanes(const PlacedCollider& solid, std::vector<std::pair<Vector3d, double>>& planes) {
  const Vector3d& at = solid.end.position_m;
  if (const auto map = MapOf(*solid.collider)) {
    for (const auto& triangle : map->mesh().triangles) {
      const Vector3d& a = map->mesh().positions_m[triangle[0]];
      const Vector3d& b = map->mesh().positions_m[triangle[1]];
      const Vector3d n = (b - a).cross(map->mesh().positions_m[triangle[2]] - a).normalized();
      planes.emplace_back(n, n.dot(a + at));
    }
    return;
  }
  const auto& half = std::get<BoxShape>(solid.collider->shape).half_extents_m;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d n = solid.collider->pose.rotation * Vector3d::Unit(axis);
    for (const double side : {1.0, -1.0}) {
      planes.emplace_back(side * n, side * n.dot(at) + half[axis]);
    }
  }
}

// Two solids of flat faces have something in common if a corner of that is where three of their
// planes meet.
bool HaveACommonPoint(const Pair& pair) {
  std::vector<std::pair<Vector3d, double>> planes;
  AddPlanes(pair.first, planes);
  AddPlanes(pair.second, planes);
  for (size_t i = 0; i < planes.size(); ++i) {
    for (size_t j = i + 1; j < planes.size(); ++j) {
      for (size_t k = j + 1; k < planes.size(); ++k) {
        Eigen::Matrix3d normals;
        normals << planes[i].first.transpose(), planes[j].first.transpose(),
            planes[k].first.transpose();
        if (std::abs(normals.determinant()) < 1e-9) continue;
        const Vector3d corner =
            normals.inverse() * Vector3d(planes[i].second, planes[j].second, planes[k].second);
        if (std::ranges::all_of(planes, [&](const auto& plane) {
              return plane.first.dot(corner) <= plane.second + 1e-9;
            })) {
          return true;
        }
      }
    }
  }
  return false;
}

bool DoOverlap(const Pair& pair) {
  if (IsFlat(pair.first) && IsFlat(pair.second)) return HaveACommonPoint(pair);
  return DistanceOf(pair) < 1e-9;
}

struct Found {
  double least_gap = kFar;
  Vector3d n = Vector3d::Zero();
  std::vector<PairSpot> spots;
  std::vector<double> gaps;
};

Found SpotsOf(const Pair& pair, double near_m) {
  ConvexPair convex(*ConvexSolid::Of(*pair.first.collider),
                    *ConvexSolid::Of(*pair.second.collider));
  convex.FindSpots(pair.first, pair.second, PointsOf(*pair.first.collider),
                   PointsOf(*pair.second.collider), near_m, 1e-12);
  Found found;
  found.spots = convex.spots();
  EXPECT_LE(found.spots.size(), convex.most_spots());
  for (const PairSpot& spot : found.spots) {
    const SurfaceDistance gap = convex.GapAt(spot, pair.first.end, pair.second.end);
    found.gaps.push_back(gap.distance_m);
    found.least_gap = std::min(found.least_gap, gap.distance_m);
    found.n = gap.outward;
  }
  return found;
}

constexpr ShapeKind kKinds[] = {ShapeKind::kBox, ShapeKind::kCylinder, ShapeKind::kCapsule,
                                ShapeKind::kDistanceMap};

// Of what is apart, no gap is larger than the distance; what is moved out by the depth, and a
// little more, is apart, and by a little less it is not. Rims are tried in some points: there the
// depth may be too large.
TEST(ConvexPair, MovesOutByTheDepth) {
  Random random(3);
  for (const ShapeKind a : kKinds) {
    for (const ShapeKind b : kKinds) {
      const bool has_rim = a == ShapeKind::kCylinder || b == ShapeKind::kCylinder;
      const bool has_map = a == ShapeKind::kDistanceMap || b == ShapeKind::kDistanceMap;
      const auto is_flat = [](ShapeKind kind) {
        return kind == ShapeKind::kBox || kind == ShapeKind::kDistanceMap;
      };
      if (has_map && !(is_flat(a) && is_flat(b))) continue;
      int overlapping = 0;
      for (int trial = 0; trial < 60; ++trial) {
        SCOPED_TRACE(testing::Message() << kShapeNames[static_cast<size_t>(a)] << ' '
                                        << kShapeNames[static_cast<size_t>(b)] << ' ' << trial);
        const Collider first = random.Solid(a), second = random.Solid(b);
        Pair pair(first, second, random.Between(0, 0.25) * random.Direction());
        if (!DoOverlap(pair)) {
          // Samples know the distance of a mesh too badly.
          EXPECT_TRUE(has_map || SpotsOf(pair, kFar).least_gap <= DistanceOf(pair) + 1e-9);
          continue;
        }
        ++overlapping;
        const Found found = SpotsOf(pair, 0);
        ASSERT_FALSE(found.spots.empty());
        constexpr double kLittle = 1e-4;
        pair.Shift((kLittle - found.least_gap) * found.n);
        EXPECT_FALSE(DoOverlap(pair));
        pair.Shift(-2 * kLittle * found.n);
        EXPECT_TRUE(has_rim || DoOverlap(pair));
      }
      EXPECT_GE(overlapping, 10);
    }
  }
}

// Spots are on the surfaces of both, and a box that lies on another one has all of what both have
// in common: its corners add up to the right area.
TEST(ConvexPair, SpotsAreTheCornersOfWhatBothHaveInCommon) {
  const Collider lower = BoxAt(Vector3d::Zero(), {0.3, 0.1, 0.2});
  Random random(4);
  for (int trial = 0; trial < 50; ++trial) {
    const double u = random.Between(0.05, 0.4), v = random.Between(0.05, 0.4);
    const Collider upper = BoxAt(Vector3d::Zero(), {u, 0.05, v});
    const Vector3d way(random.Between(-0.3, 0.3), 0.15, random.Between(-0.2, 0.2));
    const Found found = SpotsOf(Pair(upper, lower, way), 1e-9);
    const auto overlap = [](double at, double half, double other) {
      return std::min(at + half, other) - std::max(at - half, -other);
    };
    const double width = overlap(way.x(), u, 0.3), depth = overlap(way.z(), v, 0.2);
    ASSERT_EQ(found.spots.size(), 4u);
    Vector3d low = Vector3d::Constant(kFar), high = -low;
    for (size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(found.gaps[k], 0, 1e-15);
      EXPECT_NEAR(found.n.y(), 1, 1e-15);
      EXPECT_NEAR(found.spots[k].on_second.y(), 0.1, 1e-15);
      EXPECT_NEAR(found.spots[k].on_first.y(), -0.05, 1e-15);
      low = low.cwiseMin(found.spots[k].on_second);
      high = high.cwiseMax(found.spots[k].on_second);
    }
    EXPECT_NEAR(high.x() - low.x(), width, 1e-14);
    EXPECT_NEAR(high.z() - low.z(), depth, 1e-14);
  }
}

// Exactly flush: the corners of one of both, once.
TEST(ConvexPair, WhatIsFlushHasEachCornerOnce) {
  for (const double turn : {0.0, 0.3, 1.1}) {
    const Quaterniond turned(Eigen::AngleAxisd(turn, Vector3d(1, 2, 3).normalized()));
    const Collider cube = BoxAt(Vector3d::Zero(), Vector3d::Constant(0.05), turned);
    EXPECT_EQ(SpotsOf(Pair(cube, cube, turned * Vector3d(0, 0.1, 0)), 1e-9).spots.size(), 4u);
    // Half over it.
    EXPECT_EQ(SpotsOf(Pair(cube, cube, turned * Vector3d(0.05, 0.1, 0)), 1e-9).spots.size(), 4u);
  }
}

// Edge over edge: one spot, where they cross.
TEST(ConvexPair, EdgesTouchWhereTheyCross) {
  const Quaterniond on_edge(Eigen::AngleAxisd(M_PI / 4, Vector3d::UnitX()));
  const Quaterniond across(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitY()));
  const Vector3d half(0.3, 0.05, 0.05);
  const Collider lower = BoxAt(Vector3d::Zero(), half, on_edge);
  const Collider upper = BoxAt(Vector3d::Zero(), half, across * on_edge);
  const double height = 2 * 0.05 * std::sqrt(2.0);
  const Found found = SpotsOf(Pair(upper, lower, {0.02, height - 1e-4, 0.07}), 0);
  ASSERT_FALSE(found.spots.empty());
  EXPECT_NEAR(found.least_gap, -1e-4, 1e-12);
  EXPECT_NEAR(found.n.y(), 1, 1e-12);
  size_t deep = 0;
  for (const double gap : found.gaps) deep += gap < 0;
  EXPECT_EQ(deep, 1u);
}

}  // namespace
}  // namespace drape::bodies
