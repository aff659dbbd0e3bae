// Solids of every shape, turned and placed at random, and points around them.
#pragma once

#include <memory>
#include <random>
#include <vector>

#include "server/core/check.h"
#include "server/scene/colliders.h"
#include "server/scene/distance_map.h"
#include "tests/support/solids/solids.h"

namespace drape::test {

class RandomSolids {
 public:
  explicit RandomSolids(unsigned seed) : random_(seed) {}

  double Between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Eigen::Vector3d Point(double size) {
    return {Between(-size, size), Between(-size, size), Between(-size, size)};
  }
  Eigen::Quaterniond Rotation() {
    return Eigen::Quaterniond(Between(-1, 1), Between(-1, 1), Between(-1, 1), Between(-1, 1))
        .normalized();
  }
  // Within about 0.5 m of the origin.
  Collider Convex(ShapeKind kind) {
    const Eigen::Vector3d a = Point(0.2), b = Point(0.2);
    switch (kind) {
      case ShapeKind::kCapsule:
        return CapsuleBetween(a, b, Between(0.01, 0.2));
      case ShapeKind::kCylinder:
        return CylinderBetween(a, b, Between(0.01, 0.2));
      case ShapeKind::kBox:
        return BoxAt(a, {Between(0.01, 0.2), Between(0.01, 0.2), Between(0.01, 0.2)}, Rotation());
      default:
        return SphereAt(a, Between(0.01, 0.3));
    }
  }

 private:
  std::mt19937 random_;
};

inline const std::vector<ShapeKind> kConvexKinds = {ShapeKind::kSphere, ShapeKind::kCapsule,
                                                    ShapeKind::kBox, ShapeKind::kCylinder};

// A ball as a closed mesh, sampled.
inline std::shared_ptr<const DistanceMap> BallMap(double radius_m, uint32_t resolution) {
  auto map = DistanceMap::Build(SphereMesh(radius_m, 4), {.resolution = resolution});
  DRAPE_CHECK(map.ok(), "the ball is closed");
  return *map;
}

}  // namespace drape::test
