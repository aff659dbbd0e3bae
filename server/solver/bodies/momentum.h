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

// When impulses are found: for where the substep ends, or for the velocities there.
enum class When : size_t { kSubstep, kEnd };

}  // namespace drape::bodies
