// What should come to rest, or hold or slide on a slope.
#pragma once

#include "tests/bench/accuracy/quantities.h"

namespace drape::bench {

// Ten kinds of cloths and places to rest, damped: the second difference of positions over frames in
// the second after 12 s.
std::vector<QuantityScene> RestScenes(bool is_quick);

// Sheets, meshes and bare particles on a slope: how far they move, 2 % on either side of static
// friction, at several ratios of both coefficients and distances from the origin.
std::vector<QuantityScene> SlopeScenes(bool is_quick);

}  // namespace drape::bench
