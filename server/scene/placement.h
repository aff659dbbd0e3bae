// Frames: world = environment + environment_origin_m; environment = cloth frame +
// origin_in_environment_m.
#pragma once

#include <Eigen/Core>

namespace drape {

// The place of a cloth's own frame. Solvers see only this frame; everything that enters or leaves
// them is shifted here, in double precision. Copies that differ only by environment_origin_m
// therefore compute the same bits.
struct Placement {
  Eigen::Vector3d environment_origin_m = Eigen::Vector3d::Zero();  // in the world
  Eigen::Vector3d origin_in_environment_m = Eigen::Vector3d::Zero();

  Eigen::Vector3d ClothFromEnvironment(const Eigen::Vector3d& p) const {
    return p - origin_in_environment_m;
  }
  Eigen::Vector3d EnvironmentFromCloth(const Eigen::Vector3d& p) const {
    return p + origin_in_environment_m;
  }
  Eigen::Vector3d WorldFromCloth(const Eigen::Vector3d& p) const {
    return p + (origin_in_environment_m + environment_origin_m);
  }
};

}  // namespace drape
