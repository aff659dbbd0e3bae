// Contact geometry and Coulomb friction of single particles. Pure functions.
#pragma once

#include <Eigen/Core>

#include "server/scene/colliders.h"

namespace drape {

struct ReferenceContact {
  double gap = 0;          // distance to the collider less the thickness, negative inside [m]
  Eigen::Vector3d normal;  // outward, unit
};

ReferenceContact ContactAt(const Collider& collider, double thickness_m, const Eigen::Vector3d& q);

// Accumulated impulse times inverse mass of one particle at one collider during a substep [m/s].
struct ContactImpulse {
  double normal = 0;  // >= 0
  Eigen::Vector3d tangential = Eigen::Vector3d::Zero();
};

// Coulomb's law on accumulated impulses: `wanted` stops the sliding; it is granted up to the static
// limit, beyond that its size becomes the dynamic friction.
Eigen::Vector3d CoulombImpulse(const Eigen::Vector3d& wanted, double normal_impulse,
                               double friction_static, double friction_dynamic);

}  // namespace drape
