// How the strips of a resident cloth are solved (server/solver/method.md, "solve_strips").
#pragma once

namespace drape {

enum class StripSolve {
  // One invocation per strip eliminates link after link.
  kElimination,
  // Two invocations per strip eliminate its links from both ends towards the middle.
  kFromBothEnds,
  // Cyclic reduction: a subgroup solves all links of a strip at once and passes values on by
  // shuffles. For strips of at most DRAPE_STRIP_LANES links.
  kReduction,
  // The same arithmetic with shared memory and barriers instead of shuffles, to test it on devices
  // without subgroups. Slower than elimination.
  kReductionWithBarriers,
};

constexpr bool IsReduction(StripSolve strip_solve) {
  return strip_solve == StripSolve::kReduction || strip_solve == StripSolve::kReductionWithBarriers;
}

}  // namespace drape
