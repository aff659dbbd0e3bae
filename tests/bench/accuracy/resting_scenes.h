// What should come to rest, or hold or slide on a slope or a bar, and what catches a ball.
#pragma once

#include "tests/bench/accuracy/quantities.h"

namespace drape::bench {

// Ten kinds of cloths and places to rest, damped: the second difference of positions over frames in
// the second after 12 s.
std::vector<QuantityScene> RestScenes(bool is_quick);

// Sheets, meshes and bare particles on a slope: how far they move, 2 % on either side of static
// friction, at several ratios of both coefficients and distances from the origin.
std::vector<QuantityScene> SlopeScenes(bool is_quick);

// Chains over bars, the load 2 % below what static friction holds, at several coefficients of both
// and angles between links: how far it sinks in the second second.
std::vector<QuantityScene> CapstanScenes(bool is_quick);

// Balls of 0.1 to 3 times its mass that fall onto a sheet held by its corners: the largest strain
// of any link in any frame.
std::vector<QuantityScene> CatchScenes(bool is_quick);

}  // namespace drape::bench
