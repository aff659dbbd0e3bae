// What impulses on one collider add up to.
#pragma once

#include <Eigen/Core>
#include <cstddef>

namespace drape::bodies {

struct Momentum {
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();   // [N s]
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();  // about its centre [N m s]

  void Add(const Momentum& other) {
    linear += other.linear;
    angular += other.angular;
  }
};

// What impulses are found for: where the substep ends; the velocities there; or, in place of the
// first, the places alone: these are shifted, and no velocity changes.
enum class When : size_t { kSubstep, kEnd, kShift };

}  // namespace drape::bodies
