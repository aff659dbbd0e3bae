#include "server/scene/colliders.h"

#include <cmath>

namespace drape {

Eigen::Vector3d NormalOnSegment(const CapsuleCollider& capsule) {
  const Eigen::Vector3d segment = capsule.b_m - capsule.a_m;
  if (segment.isZero(0)) return Eigen::Vector3d::UnitY();
  const Eigen::Vector3d axis = segment.stableNormalized();
  const bool is_steep = std::abs(axis.y()) > 0.9;
  const Eigen::Vector3d side = is_steep ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  return (side - side.dot(axis) * axis).normalized();
}

}  // namespace drape
