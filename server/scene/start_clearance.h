// The start of a cloth that is described caught in a collider: contacts would push the ends of a
// link out to different sides, and the cloth would stay around the collider, stretched.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "server/scene/avoided_colliders.h"

namespace drape {

// A link whose ends are both inside a collider is caught where, each out by the nearest way, they
// are farther apart than this many times its length [-] (or than they are described, if that is
// more). On a surface of radius R such a link is deeper than R/2, at an edge of a box deeper than
// 0.7 of its length; it never has both ends less deep than half its length. Smaller: cloths a
// little deep in a tight curve would be moved, although contacts bring them out without harm.
// Larger: links that contacts tear apart start as described.
inline constexpr double kCaughtRatio = 2;

enum class StartClearance : uint8_t {
  kFree,     // no link is caught: starts as described
  kCleared,  // starts beside the colliders
  kCaught,   // no place was found that is good enough: starts as described
};

struct ClearStart {
  StartClearance clearance = StartClearance::kFree;
  std::vector<Eigen::Vector3d> positions_m{};  // kCleared only
  LengthErrors errors{};                       // of positions_m, colliders included
  // Of a mesh that has no room outside (start_fitting.h): the lengths it has there, and the largest
  // change of one, relative to its length [-].
  std::vector<LetOutLink> let_out{};
  double largest_let_out = 0;
};

// Looks for caught links. Particles that hang together inside a collider by links, some of them
// caught, are led out to one side of the sheet that they are part of: along its normal there, to
// the side that takes the least motion (sum m |dx|^2), or to `up` (unit) if both take about the
// same. Then lengths are restored with the colliders as further demands (RestoreLengths). If the
// result is not good enough, the other side is tried, then the nearest ways out. A result is good
// enough if its errors need no restoring (NeedsRestoring) and no link is caught.
//
// Rigid links keep their lengths; compliant ones get no longer than they are described; springs are
// not looked at. Pins stay: a link that is caught with one of its ends pinned cannot be freed.
// Without caught links, one look at each particle and collider, and at the links of those that have
// particles inside. A pure function, the same bits every time. Any thread.
ClearStart ClearOfColliders(const LengthDemands& demands, const AvoidedColliders& avoided,
                            const Eigen::Vector3d& up,
                            std::span<const Eigen::Vector3d> positions_m);

}  // namespace drape
