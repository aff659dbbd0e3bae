#include "server/render/gl_draw/collider_shapes.h"

#include <gtest/gtest.h>

#include "server/scene/distance_map.h"
#include "tests/gl_draw/pictures.h"
#include "tests/support/solids/solids.h"

namespace drape::render {
namespace {

using Eigen::Vector3d;

DrawnCloth Cloth(double length_m, std::vector<Collider> colliders,
                 const Vector3d& environment = Vector3d::Zero()) {
  return {.model = ChainModel(3, length_m),
          .placement = {.environment_origin_m = environment},
          .colliders = std::move(colliders)};
}

TEST(ColliderShapesTest, SharedOnesAreDrawnOnce) {
  const Collider sphere = SphereAt({1, 2, 3}, 0.5);
  const Collider plane = PlaneThrough({0, -1, 0}, Vector3d::UnitY());
  // The same plane through another point, and the same sphere from another environment.
  const Collider same_plane = PlaneThrough({5, -1, 7}, Vector3d::UnitY());
  const Collider moved = SphereAt({-9, 2, 3}, 0.5);
  const std::vector<DrawnCloth> cloths = {Cloth(0.01, {sphere, plane}),
                                          Cloth(0.02, {same_plane, sphere}),
                                          Cloth(0.01, {moved}, {10, 0, 0})};
  const ColliderShapes shapes = CollectColliders(cloths);
  ASSERT_EQ(shapes.solids.size(), 1u);
  ASSERT_EQ(shapes.planes.size(), 1u);
  EXPECT_NEAR((shapes.solids[0].center_m - Vector3d(1, 2, 3)).norm(), 0, 1e-12);
  EXPECT_NEAR(shapes.planes[0].point_m.y(), -1, 1e-12);
  // Small enough for the coarsest cloth: diagonals of 0.02 m squares, stretched by a fifth.
  const double sag = 2 * 1.44 * 0.02 * 0.02 / (8 * 0.5);
  EXPECT_NEAR(shapes.solids[0].drawn_radius_m, 0.5 - sag - 0.002, 1e-12);
}

TEST(ColliderShapesTest, DifferentOnesStay) {
  const Collider sphere = SphereAt({1, 2, 3}, 0.5);
  const Collider larger = SphereAt({1, 2, 3}, 0.6);
  const std::vector<DrawnCloth> cloths = {
      Cloth(0.1, {sphere, larger, PlaneThrough({0, 1, 0}, Vector3d::UnitY()),
                  PlaneThrough({0, 1, 0}, Vector3d::UnitX())}),
      Cloth(0.1, {sphere}, {0, 0, 1})};
  const ColliderShapes shapes = CollectColliders(cloths);
  EXPECT_EQ(shapes.solids.size(), 3u);
  EXPECT_EQ(shapes.planes.size(), 2u);
}

TEST(ColliderShapesTest, ASphereSmallerThanTheEdgesKeepsMostOfItsRadius) {
  const std::vector<DrawnCloth> cloths = {Cloth(1, {SphereAt({0, 0, 0}, 0.1)})};
  EXPECT_NEAR(CollectColliders(cloths).solids[0].drawn_radius_m, 0.075, 1e-12);
}

TEST(ColliderShapesTest, ACapsuleIsASegmentWithARadius) {
  const Collider capsule = CapsuleBetween({1, 0, 0}, {1, 0, 3}, 0.5);
  const ColliderShapes shapes = CollectColliders(std::vector{Cloth(0.01, {capsule}, {0, 1, 0})});
  ASSERT_EQ(shapes.solids.size(), 1u);
  const DrawnSolid& solid = shapes.solids[0];
  EXPECT_NEAR((solid.center_m - Vector3d(1, 1, 1.5)).norm(), 0, 1e-12);
  EXPECT_NEAR(std::abs(solid.axes.col(1).z()), 1, 1e-12);
  EXPECT_NEAR((solid.half_extents_m - Vector3d(0, 1.5, 0)).norm(), 0, 1e-12);
  EXPECT_EQ(solid.radius_m, 0.5);
  EXPECT_LT(solid.drawn_radius_m, 0.5);
}

TEST(ColliderShapesTest, ACylinderIsAMeshOfItsDrawnSize) {
  const Collider cylinder = CylinderBetween({1, 0, 0}, {1, 0, 3}, 0.5);
  const auto solids =
      CollectColliders(std::vector{Cloth(0.01, {cylinder}, {0, 1, 0}), Cloth(0.1, {cylinder}),
                                   Cloth(0.001, {cylinder})})
          .solids;
  ASSERT_EQ(solids.size(), 2u) << "each place once";
  for (const DrawnSolid& solid : solids) {
    EXPECT_EQ(solid.radius_m, 0);
    EXPECT_NEAR((solid.half_extents_m - Vector3d(0.5, 1.5, 0.5)).norm(), 0, 1e-12);
    EXPECT_NEAR(std::abs(solid.axes.col(1).z()), 1, 1e-12);
    const double length_m = solid.center_m.y() > 0.5 ? 0.01 : 0.1;  // the coarser cloth
    const double half_length_m = 1.5 - 0.2 * length_m - 0.004 * 1.5;
    const double radius_m = 0.5 - 2 * 1.44 * length_m * length_m / (8 * 0.5) - 0.004 * 0.5;
    double volume_m3 = 0;
    for (const auto& [i, j, k] : solid.mesh->triangles) {
      const auto drawn = [&](uint32_t vertex) -> Vector3d {
        return solid.mesh->positions_m[vertex].cwiseProduct(solid.mesh_scale);
      };
      const Vector3d p = drawn(i);
      volume_m3 += p.dot(drawn(j).cross(drawn(k))) / 6;
      EXPECT_LE(std::hypot(p.x(), p.z()), radius_m + 1e-12);
      EXPECT_NEAR(std::abs(p.y()), half_length_m, 1e-12);
    }
    EXPECT_NEAR(volume_m3, M_PI * radius_m * radius_m * 2 * half_length_m, 0.002)
        << "closed, outside outwards";
  }
}

TEST(ColliderShapesTest, ABoxKeepsItsAxes) {
  Collider box = BoxAt({1, 2, 3}, {0.3, 0.2, 0.1});
  box.pose.rotation = Eigen::AngleAxisd(0.4, Vector3d::UnitX());
  const DrawnSolid solid = CollectColliders(std::vector{Cloth(0.01, {box})}).solids.at(0);
  EXPECT_NEAR((solid.axes - box.pose.rotation.toRotationMatrix()).norm(), 0, 1e-12);
  EXPECT_EQ(solid.radius_m, 0);
  EXPECT_NEAR(solid.drawn_half_extents_m.x(), 0.3 - 0.002 - 0.0012, 1e-12);
  for (const Vector3d& corner : CornersOf(solid)) {
    EXPECT_NEAR((corner - solid.center_m).norm(), Vector3d(0.3, 0.2, 0.1).norm(), 1e-12);
  }
}

TEST(ColliderShapesTest, AMeshHasItsMapAndTheBoxAroundIt) {
  const auto map =
      DistanceMap::Build(test::BoxMesh({1, 0, 0}, {2, 0.5, 0.25}), {.resolution = 8}).value();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.4, Vector3d::UnitX()));
  const Collider mesh = DistanceMapAt(map, {{1, 2, 3}, turn});
  const Collider elsewhere = DistanceMapAt(map, {{1, 2, 4}, turn});
  const auto solids =
      CollectColliders(std::vector{Cloth(0.01, {mesh, elsewhere}), Cloth(0.1, {mesh})}).solids;
  ASSERT_EQ(solids.size(), 2u) << "each place once";
  EXPECT_EQ(solids[0].mesh.get(), &map->mesh());
  EXPECT_NEAR((solids[0].center_m - mesh.pose * Vector3d(1.5, 0.25, 0.125)).norm(), 0, 1e-12);
  EXPECT_NEAR((solids[0].half_extents_m - Vector3d(0.5, 0.25, 0.125)).norm(), 0, 1e-12);
  EXPECT_NEAR(solids[0].inset_m, 0.03, 1e-12) << "for the coarser cloth";
  EXPECT_NEAR(solids[1].inset_m, 0.003, 1e-12);
}

TEST(ColliderShapesTest, OnlySolidsOfTheSizeOfThePictureAreNear) {
  const Eigen::AlignedBox3d bounds(Vector3d::Zero(), Vector3d(3, 4, 0));  // diagonal 5
  const auto sphere = [](double x, double radius) {
    DrawnSolid solid;
    solid.center_m = {x, 2, 0};
    solid.radius_m = radius;
    return solid;
  };
  EXPECT_TRUE(IsNear(sphere(1, 0.3), bounds));
  EXPECT_TRUE(IsNear(sphere(6.4, 1), bounds));     // a gap of 2.4
  EXPECT_FALSE(IsNear(sphere(6.6, 1), bounds));    // of 2.6
  EXPECT_FALSE(IsNear(sphere(-98, 100), bounds));  // a ground
}

}  // namespace
}  // namespace drape::render
