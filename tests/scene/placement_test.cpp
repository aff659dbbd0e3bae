#include "server/scene/placement.h"

#include <gtest/gtest.h>

#include "server/scene/description.h"

namespace drape {
namespace {

TEST(Placement, FramesAddUp) {
  const Placement placement{.environment_origin_m = {10, 0, 0},
                            .origin_in_environment_m = {0, 2, 1}};
  EXPECT_EQ(placement.EnvironmentFromCloth({1, 1, 1}), Eigen::Vector3d(1, 3, 2));
  EXPECT_EQ(placement.ClothFromEnvironment({1, 3, 2}), Eigen::Vector3d(1, 1, 1));
  EXPECT_EQ(placement.WorldFromCloth({1, 1, 1}), Eigen::Vector3d(11, 3, 2));
}

TEST(RigidTransform, RotatesFirst) {
  RigidTransform transform;
  transform.position_m = {1, 0, 0};
  transform.rotation = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY());
  // A quarter turn about +y takes +x to -z; sines of rounded angles are good to one ulp of 1.
  const Eigen::Vector3d expected(1, 0, -2);
  EXPECT_LE((transform * Eigen::Vector3d(2, 0, 0) - expected).norm(), 8 * 2.3e-16);
}

}  // namespace
}  // namespace drape
