// What bodies need of the parameters of a cloth.
#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "server/solver/cloth_parameters.h"

namespace drape {

// The material of the cloth counts between bodies and other colliders, too.
struct BodyNumbers {
  Eigen::Vector3d gravity_m_per_s2 = Eigen::Vector3d::Zero();
  double thickness_m = 0;  // of the cloth
  double friction_static = 0;
  double friction_dynamic = 0;
  double restitution = 0;
  double slowest_rebound_m_per_s = 0;
};

inline BodyNumbers BodyNumbersOf(const ClothParameters& parameters) {
  return {.gravity_m_per_s2 = parameters.gravity_m_per_s2,
          .thickness_m = parameters.thickness_m,
          .friction_static = parameters.friction_static,
          .friction_dynamic = parameters.friction_dynamic,
          .restitution = parameters.restitution,
          .slowest_rebound_m_per_s = SlowestRebound(parameters)};
}

}  // namespace drape
