// The colliders that the particles of a cloth must avoid at its start.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "server/core/interruption.h"
#include "server/scene/colliders.h"
#include "server/scene/start_positions.h"

namespace drape {

struct AvoidedColliders {
  std::span<const Collider> colliders;   // where they are
  double thickness_m = 0;                // gap = distance to a collider - thickness
  Interruption* interruption = nullptr;  // asked between sweeps; null: nobody is
};

// RestoreLengths (start_positions.h) with colliders as further demands: free particles inside leave
// them the nearest way. The errors include theirs, depth / length scale.
LengthErrors RestoreLengths(const LengthDemands& demands, std::vector<Eigen::Vector3d>& positions_m,
                            const AvoidedColliders& avoided);

}  // namespace drape
