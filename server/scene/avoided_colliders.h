// The colliders that the particles of a cloth must avoid at its start.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "server/scene/colliders.h"
#include "server/scene/start_positions.h"

namespace drape {

struct AvoidedColliders {
  std::span<const Collider> colliders;  // where they are
  double thickness_m = 0;               // gap = distance to a collider - thickness
  // Asked between sweeps: nobody wants the start any more, and what there is will do. Empty: never.
  std::function<bool()> is_unwanted{};

  bool AreUnwanted() const { return is_unwanted && is_unwanted(); }
};

// RestoreLengths (start_positions.h) with colliders as further demands: free particles inside leave
// them the nearest way. The errors include theirs, depth / length scale.
LengthErrors RestoreLengths(const LengthDemands& demands, std::vector<Eigen::Vector3d>& positions_m,
                            const AvoidedColliders& avoided);

}  // namespace drape
