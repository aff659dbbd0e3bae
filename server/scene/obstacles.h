// Solids that the particles of a cloth must avoid at its start.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "server/scene/colliders.h"
#include "server/scene/start_positions.h"

namespace drape {

struct Obstacles {
  std::span<const Collider> colliders;  // where they are
  double thickness_m = 0;               // gap = distance to a collider - thickness
};

// RestoreLengths (start_positions.h) with obstacles as further demands: free particles inside go
// out the nearest way. The errors have those of obstacles, depth / length scale.
LengthErrors RestoreLengths(const LengthDemands& demands, std::vector<Eigen::Vector3d>& positions_m,
                            const Obstacles& obstacles);

}  // namespace drape
