#include "server/scene/colliders.h"

#include <gtest/gtest.h>

#include <cmath>

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

}  // namespace
}  // namespace drape
