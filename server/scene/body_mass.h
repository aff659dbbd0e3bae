// Mass, centre and inertia of colliders that are rigid bodies. Pure.
#pragma once

#include <Eigen/Core>

#include "server/scene/colliders.h"

namespace drape {

struct BodyMass {
  double mass_kg = 0;                                     // > 0
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();     // centre of mass, as described
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Identity();  // about it, axes as described [kg m^2]
};

// Of a solid of uniform density, whatever its pose; not of a plane. A collider without a mass has
// the density 1.
BodyMass MassOf(const Collider& collider);

// The centre of mass of MassOf: the point whose motion a body's state tells.
Eigen::Vector3d CentreOfMass(const Collider& collider);

}  // namespace drape
