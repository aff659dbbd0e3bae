// Distance of a point from a collider, in double precision.
#pragma once

#include "server/scene/colliders.h"
#include "server/scene/distance_map.h"

namespace drape {

// Distance and normal of a collider at its described place; colliders.h defines `outward` where the
// distance has no gradient.
SurfaceDistance SurfaceOf(const Collider& collider, const Eigen::Vector3d& q);

}  // namespace drape
