// Shapes a cloth can touch, as implicit functions (paper section 4.1).
#pragma once

#include <Eigen/Core>
#include <variant>

namespace drape {

struct SphereCollider {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  double radius_m = 0;  // > 0
};

// Solid on the side away from the normal.
struct PlaneCollider {
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();  // unit
};

using Collider = std::variant<SphereCollider, PlaneCollider>;

}  // namespace drape
