#include "server/scene/triangle_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/solids/solids.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

const Vector3d kA(0, 0, 0);
const Vector3d kB(4, 0, 0);
const Vector3d kC(0, 3, 0);

void ExpectNearest(const Vector3d& p, double distance, const Vector3d& point,
                   TriangleFeature feature, int feature_index) {
  const NearestOnTriangle nearest = NearestPoint(MakeTriangleGeometry(kA, kB, kC), p);
  EXPECT_NEAR(nearest.distance_sq, distance * distance, 1e-14) << p.transpose();
  EXPECT_NEAR((nearest.point_m - point).norm(), 0, 1e-14) << p.transpose();
  EXPECT_EQ(nearest.feature, feature) << p.transpose();
  EXPECT_EQ(int{nearest.feature_index}, feature_index) << p.transpose();
}

TEST(TriangleDistanceTest, KnowsEachOfTheSevenRegions) {
  ExpectNearest({1, 1, 5}, 5, {1, 1, 0}, TriangleFeature::kFace, 0);
  ExpectNearest({1, 1, -5}, 5, {1, 1, 0}, TriangleFeature::kFace, 0);
  ExpectNearest({2, -1, 0}, 1, {2, 0, 0}, TriangleFeature::kEdge, 0);
  ExpectNearest({2 + 3, 1.5 + 4, 0}, 5, {2, 1.5, 0}, TriangleFeature::kEdge, 1);
  ExpectNearest({-3, 1, 4}, 5, {0, 1, 0}, TriangleFeature::kEdge, 2);
  ExpectNearest({-3, -4, 0}, 5, kA, TriangleFeature::kCorner, 0);
  ExpectNearest({7, 0, 4}, 5, kB, TriangleFeature::kCorner, 1);
  ExpectNearest({0, 6, 4}, 5, kC, TriangleFeature::kCorner, 2);
}

// Beyond two edges at once, on both sides of the corner between them.
TEST(TriangleDistanceTest, TakesTheNearestEdgeOfAnObtuseTriangle) {
  const Vector3d b(1, 0, 0);
  const Vector3d c(-5, 0.5, 0);
  const TriangleGeometry obtuse = MakeTriangleGeometry(kA, b, c);
  Random random(3);
  for (int k = 0; k < 1000; ++k) {
    const Vector3d p = PointInBox(random, {-7, -3, -1}, {3, 3, 1});
    EXPECT_NEAR(std::sqrt(NearestPoint(obtuse, p).distance_sq), DistanceToTriangle(p, kA, b, c),
                1e-14);
  }
}

double DistanceToSegment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const double along = (p - a).dot(b - a) / (b - a).squaredNorm();
  return (p - a - std::clamp(along, 0.0, 1.0) * (b - a)).norm();
}

// A sliver is within its height of its edges; only the rounding of coordinates is lost.
TEST(TriangleDistanceTest, KeepsItsDigitsInSlivers) {
  const Vector3d b(1, 0, 0.2);
  Random random(4);
  for (const double height : {1e-2, 1e-5, 1e-8, 1e-11}) {
    const Vector3d c = 0.4 * b + Vector3d(0, height, 0);
    const TriangleGeometry sliver = MakeTriangleGeometry(kA, b, c);
    for (int k = 0; k < 300; ++k) {
      const Vector3d p = PointInBox(random, {-1, -1, -1}, {2, 1, 1});
      const double to_edges = std::min(
          {DistanceToSegment(p, kA, b), DistanceToSegment(p, b, c), DistanceToSegment(p, c, kA)});
      const double distance = std::sqrt(NearestPoint(sliver, p).distance_sq);
      EXPECT_LE(distance, to_edges + 1e-15) << height;
      EXPECT_GE(distance, to_edges - height - 1e-15) << height;
    }
  }
}

TEST(TriangleDistanceTest, IsExactlyZeroOnCorners) {
  for (const Vector3d& corner : {kA, kB, kC}) {
    EXPECT_EQ(NearestPoint(MakeTriangleGeometry(kA, kB, kC), corner).distance_sq, 0);
  }
}

}  // namespace
}  // namespace drape::test
