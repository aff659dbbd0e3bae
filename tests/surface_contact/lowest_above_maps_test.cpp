// Where edges and triangles are lowest above distance maps, against sampling them.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "server/scene/distance_map.h"
#include "tests/surface_contact/lowest_point_test.h"

namespace drape::surface_contact {
namespace {

template <class V>
class LowestAboveMapTest : public LowestPointTest<V> {};
TYPED_TEST_SUITE(LowestAboveMapTest, Vectors);

// A ball as a distance map: edges and triangles as those above the ball, but for the error of the
// map (3/8 cell^2 / R) and of its facets.
TYPED_TEST(LowestAboveMapTest, OfABall) {
  constexpr double kRadius_m = 0.2;
  const auto map = test::BallMap(kRadius_m, 48);
  const double off_m = 0.375 * map->cell_m() * map->cell_m() / kRadius_m +
                       test::LargestSagitta(test::SphereMesh(kRadius_m, 4), kRadius_m) + 1e-4;
  RandomSolids random(5);
  int edges = 0, triangles = 0;
  for (int k = 0; k < 100; ++k) {
    const RigidTransform pose{random.Point(0.2), random.Rotation()};
    const Collider collider = DistanceMapAt(map, pose);
    const Solid<TypeParam> solid(collider, kThickness_m);
    // Corners on a sphere a little larger.
    const Eigen::Vector3d up = random.Point(1).normalized();
    std::array<TypeParam, 3> corners;
    std::array<Eigen::Vector3d, 3> exact;
    for (size_t c = 0; c < 3; ++c) {
      const Eigen::Vector3d direction = (up + random.Point(0.25)).normalized();
      exact[c] = pose.position_m + (kRadius_m + 0.002) * direction;
      corners[c] = ToVector<TypeParam>(exact[c]);
    }
    const double length = (exact[1] - exact[0]).norm();
    const double sag = kRadius_m - std::sqrt(kRadius_m * kRadius_m - length * length / 4);
    const auto lowest = LowestOnEdge<TypeParam>(solid, corners[0], corners[1], kLeast_m);
    if (sag > 2 * off_m) {
      ASSERT_TRUE(lowest.is_inside) << k;
      ++edges;
      EXPECT_NEAR(lowest.gap,
                  this->LowestOf(SphereAt(pose.position_m, kRadius_m), exact[0], exact[1]), off_m);
    }
    const auto on_triangle = LowestOnTriangle<TypeParam>(solid, corners, kLeast_m);
    if (!on_triangle.is_inside) continue;
    ++triangles;
    EXPECT_NEAR(on_triangle.gap, this->LowestOf(SphereAt(pose.position_m, kRadius_m), exact),
                off_m + 5e-4);
  }
  EXPECT_GT(edges, 30);
  EXPECT_GT(triangles, 8);
}

// Facets meet in ridges, on which the slope jumps: what is lowest there is found, too. Dips that
// are a tenth of a cell deeper than all of the rim are found to that in all but some cases: a map
// is not convex.
TYPED_TEST(LowestAboveMapTest, OfTrianglesAboveRidges) {
  constexpr double kRadius_m = 0.2;
  RandomSolids random(6);
  int dips = 0, missed = 0;
  for (const auto& mesh : {test::SphereMesh(kRadius_m, 2), test::SphereMesh(kRadius_m, 3),
                           test::BoxMesh({-0.14, -0.1, -0.12}, {0.14, 0.1, 0.12})}) {
    auto made = DistanceMap::Build(mesh, {.resolution = 40});
    ASSERT_TRUE(made.ok());
    const double tenth_m = (*made)->cell_m() / 10;
    for (int k = 0; k < 150; ++k) {
      const Collider collider = DistanceMapAt(*made, {random.Point(0.2), random.Rotation()});
      const Solid<TypeParam> solid(collider, kThickness_m);
      const Eigen::Vector3d up = random.Point(1).normalized();
      const Eigen::Vector3d across = up.unitOrthogonal(), along = up.cross(across);
      std::array<TypeParam, 3> corners;
      std::array<Eigen::Vector3d, 3> exact;
      for (size_t c = 0; c < 3; ++c) {
        const double angle = 2.1 * static_cast<double>(c) + random.Between(-0.3, 0.3);
        const double size = random.Between(0.06, 0.12);
        exact[c] = collider.pose.position_m + random.Between(0.16, 0.19) * up +
                   size * (std::cos(angle) * across + std::sin(angle) * along);
      }
      // Where it touches, more or less.
      for (int again = 0; again < 3; ++again) {
        const double gap_m = this->LowestOf(collider, exact, 40) + random.Between(-1e-3, 1e-3);
        for (Eigen::Vector3d& corner : exact) corner -= gap_m * up;
      }
      for (size_t c = 0; c < 3; ++c) corners[c] = ToVector<TypeParam>(exact[c]);
      const double lowest_m = this->LowestOf(collider, exact);
      if (this->RimOf(collider, exact) - lowest_m < tenth_m) continue;
      const auto found = LowestOnTriangle<TypeParam>(solid, corners, kLeast_m);
      ++dips;
      missed += found.is_inside && found.gap - lowest_m <= tenth_m ? 0 : 1;
    }
  }
  EXPECT_GT(dips, 150);
  EXPECT_LE(missed, dips / 25);
}

}  // namespace
}  // namespace drape::surface_contact
