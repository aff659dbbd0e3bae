// Stage `tether`.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// No particle ends the substep farther from a pin than the cloth between them is long
// (scene/tethers.h).
void ApplyTethers(const StepContext& context);

// The same for blocks [begin, end) of four free particles (FloatModel::tether_block_offsets).
void PullBlocks(const StepContext& context, size_t begin, size_t end);

}  // namespace drape::cpu
