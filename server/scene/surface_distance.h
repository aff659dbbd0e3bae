#pragma once

#include <Eigen/Core>

namespace drape {

// Signed distance of a point from a surface, and the direction in which it grows.
struct SurfaceDistance {
  double distance_m = 0;                               // negative inside
  Eigen::Vector3d outward = Eigen::Vector3d::UnitY();  // unit
};

}  // namespace drape
