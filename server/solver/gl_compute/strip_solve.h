// How the strips of a resident cloth are solved (server/solver/method.md, "solve_strips").
#pragma once

#include <algorithm>
#include <cstdint>

#include "shaders/interface/bindings.h"

namespace drape {

enum class StripSolve {
  // One invocation per strip eliminates link after link.
  kElimination,
  // Two invocations per strip eliminate its links from both ends towards the middle.
  kFromBothEnds,
  // Cyclic reduction: a group of DRAPE_STRIP_LANES invocations of a subgroup solves all links of
  // its
  // strips at once and passes values on by shuffles. Strips with more particles, and tiled cloths,
  // from both ends.
  kReduction,
  // The same arithmetic with shared memory and barriers instead of shuffles, to test it on devices
  // without subgroups. Slower than elimination.
  kReductionWithBarriers,
};

constexpr bool IsReduction(StripSolve strip_solve) {
  return strip_solve == StripSolve::kReduction || strip_solve == StripSolve::kReductionWithBarriers;
}

// Invocations of a work group that solve strips by reduction at the same time.
constexpr uint32_t LaneCount(StripSolve strip_solve, uint32_t local_size) {
  return strip_solve == StripSolve::kReduction ? local_size
                                               : std::min(local_size, DRAPE_SHARED_LANES);
}

}  // namespace drape
