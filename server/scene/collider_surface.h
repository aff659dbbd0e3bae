// How far a point is from a collider, in double precision: what the solvers hold a cloth to.
#pragma once

#include "server/scene/colliders.h"
#include "server/scene/distance_map.h"

namespace drape {

// Of a collider that is where it is described; colliders.h says what `outward` is where the
// distance has no gradient.
SurfaceDistance SurfaceOf(const Collider& collider, const Eigen::Vector3d& q);

}  // namespace drape
