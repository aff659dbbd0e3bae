// How long the kernels of a cloth run, counted in passes through loops. Pure.
#pragma once

#include <cstdint>

#include "server/core/status.h"
#include "server/scene/scene_model.h"
#include "server/solver/gl_compute/planned_cloth.h"
#include "server/solver/gl_compute/strip_solve.h"

namespace drape {

// Upper bounds on the passes through loops that one invocation of `resident_step` makes. Mesa's
// llvmpipe leaves every loop for good after 65535 passes per invocation, without an error
// (server/gl/drivers.md); on hardware a watchdog stops kernels that run for seconds.
struct LoopCosts {
  uint64_t sweep = 0;    // one sweep
  uint64_t substep = 0;  // a substep without its sweeps
  uint64_t fixed = 0;    // loading, first kick, refinement, pausing, committing
};

LoopCosts CountResidentLoops(const PlannedCloth& cloth, uint32_t local_size,
                             StripSolve strip_solve = StripSolve::kElimination);

// Links of the longest strip; 0 without strips.
uint64_t LongestStrip(const StripSet& strips);

// Passes of one invocation of `tiled_refine` if every link is refined.
uint64_t CountTiledRefineLoops(const SceneModel& model, uint32_t local_size);

// About as many passes as an invocation makes to look for the pairs of a cloth that touches itself,
// where not everything is in one place.
uint64_t CountContactWalk(const SceneModel& model, uint32_t local_size);

// Whether a dispatch of `budget` passes makes progress.
bool CanRunInParts(const LoopCosts& costs, uint64_t budget);

// Dispatches that one step needs at most so that none makes more than `budget` passes. 1 where the
// whole step fits. Needs CanRunInParts.
uint64_t CountParts(const LoopCosts& costs, uint64_t substeps, uint64_t max_iterations,
                    uint64_t budget);

// Longest loop nest of the kernels that step a cloth outside the resident plan, and of `measure`,
// whose work groups have a size of their own.
uint64_t CountLongestLoop(const PlannedCloth& cloth, uint32_t local_size,
                          uint32_t measure_local_size);

}  // namespace drape
