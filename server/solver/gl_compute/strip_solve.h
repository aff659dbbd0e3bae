// How the strips of a resident cloth are solved (server/solver/method.md, "solve_strips").
#pragma once

namespace drape {

enum class StripSolve {
  // One invocation per strip eliminates link after link.
  kElimination,
  // Cyclic reduction: a subgroup solves the links of a strip all at once and hands values on by
  // shuffles. For strips of at most DRAPE_STRIP_LANES links.
  kReduction,
  // The same arithmetic with shared memory and barriers for the shuffles: how devices without
  // subgroups test it. Slower than elimination.
  kReductionWithBarriers,
};

}  // namespace drape
