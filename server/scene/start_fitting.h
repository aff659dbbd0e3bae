// Garments that have no room where they start: drawn partly inside a body, and too tight outside.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "server/scene/avoided_colliders.h"
#include "server/scene/description.h"

namespace drape {

// Contacts bring out a cloth that leaves its colliders by the nearest ways with strains up to this
// [-], which is what a report warns of. More would tear at it before the first picture.
inline constexpr double kMaxStrainOnTheWayOut = 0.05;
// Links that keep their length: those whose strain outside is below this [-].
inline constexpr double kNotLetOut = 1e-3;

struct FittedStart {
  std::vector<Eigen::Vector3d> positions_m;  // empty: contacts bring the cloth out, or it is out
  LengthErrors errors;                       // that are left, of the links that keep their length
  std::vector<LetOutLink> let_out;           // ascending
  double largest_change = 0;                 // of them, relative to the length [-]
};

// Where a cloth is once it is out: free particles inside colliders leave them the nearest way while
// links of any compliance keep their lengths as well as they can (Gauss-Seidel sweeps). Links that
// are strained there have no room: they are let out to the length that they have, or taken in. A
// pure function, the same bits every time; up to seconds for large cloths. Any thread.
FittedStart FitStart(const LengthDemands& demands, const AvoidedColliders& avoided,
                     std::span<const Eigen::Vector3d> positions_m);

}  // namespace drape
