#include "server/render/gl_draw/collider_shapes.h"

#include <gtest/gtest.h>

#include "tests/gl_draw/pictures.h"

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
  const SphereCollider sphere{.center_m = {1, 2, 3}, .radius_m = 0.5};
  const PlaneCollider plane{.point_m = {0, -1, 0}, .normal = Vector3d::UnitY()};
  // The same plane through another point, and the same sphere from another environment.
  const PlaneCollider same_plane{.point_m = {5, -1, 7}, .normal = Vector3d::UnitY()};
  const SphereCollider moved{.center_m = {-9, 2, 3}, .radius_m = 0.5};
  const std::vector<DrawnCloth> cloths = {Cloth(0.01, {sphere, plane}),
                                          Cloth(0.02, {same_plane, sphere}),
                                          Cloth(0.01, {moved}, {10, 0, 0})};
  const ColliderShapes shapes = CollectColliders(cloths);
  ASSERT_EQ(shapes.spheres.size(), 1u);
  ASSERT_EQ(shapes.planes.size(), 1u);
  EXPECT_NEAR((shapes.spheres[0].center_m - Vector3d(1, 2, 3)).norm(), 0, 1e-12);
  EXPECT_NEAR(shapes.planes[0].point_m.y(), -1, 1e-12);
  // Small enough for the coarsest cloth: diagonals of 0.02 m squares, stretched by a fifth.
  const double sag = 2 * 1.44 * 0.02 * 0.02 / (8 * 0.5);
  EXPECT_NEAR(shapes.spheres[0].drawn_radius_m, 0.5 - sag - 0.002, 1e-12);
}

TEST(ColliderShapesTest, DifferentOnesStay) {
  const SphereCollider sphere{.center_m = {1, 2, 3}, .radius_m = 0.5};
  const SphereCollider larger{.center_m = {1, 2, 3}, .radius_m = 0.6};
  const std::vector<DrawnCloth> cloths = {
      Cloth(0.1, {sphere, larger, PlaneCollider{.point_m = {0, 1, 0}, .normal = Vector3d::UnitY()},
                  PlaneCollider{.point_m = {0, 1, 0}, .normal = Vector3d::UnitX()}}),
      Cloth(0.1, {sphere}, {0, 0, 1})};
  const ColliderShapes shapes = CollectColliders(cloths);
  EXPECT_EQ(shapes.spheres.size(), 3u);
  EXPECT_EQ(shapes.planes.size(), 2u);
}

TEST(ColliderShapesTest, ASphereSmallerThanTheEdgesKeepsMostOfItsRadius) {
  const std::vector<DrawnCloth> cloths = {
      Cloth(1, {SphereCollider{.center_m = {0, 0, 0}, .radius_m = 0.1}})};
  EXPECT_NEAR(CollectColliders(cloths).spheres[0].drawn_radius_m, 0.075, 1e-12);
}

TEST(ColliderShapesTest, OnlySpheresOfTheSizeOfThePictureAreNear) {
  const Eigen::AlignedBox3d bounds(Vector3d::Zero(), Vector3d(3, 4, 0));  // diagonal 5
  const auto sphere = [](double x, double radius) {
    return DrawnSphere{{x, 2, 0}, radius, radius};
  };
  EXPECT_TRUE(IsNear(sphere(1, 0.3), bounds));
  EXPECT_TRUE(IsNear(sphere(6.4, 1), bounds));     // a gap of 2.4
  EXPECT_FALSE(IsNear(sphere(6.6, 1), bounds));    // of 2.6
  EXPECT_FALSE(IsNear(sphere(-98, 100), bounds));  // a ground
}

}  // namespace
}  // namespace drape::render
