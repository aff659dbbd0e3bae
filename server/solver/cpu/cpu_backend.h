// The single-precision backend on all cores: equal cloths side by side in the lanes of the vector
// registers, others alone, big ones among these by several threads together.
#pragma once

#include <cstdint>
#include <memory>

#include "server/solver/backend.h"

namespace drape {

struct CpuBackendOptions {
  // Threads that step cloths, the calling one included; 0 = one per core. The result does not
  // depend on it.
  uint32_t thread_count = 0;
  // Whether equal cloths are stepped side by side in the lanes of the vector registers. The result
  // does not depend on it.
  bool use_lanes = true;
  // Whether a step leaves out the colliders that a cloth cannot reach in it. The result does not
  // depend on it.
  bool leave_out_colliders = true;
};

// Named "cpu". Plan "lanes": cloths are stepped side by side wherever the batch has several that
// are alike (group_step.h); "single": always alone, on a machine without lanes.
std::unique_ptr<Backend> CreateCpuBackend(const CpuBackendOptions& options = {});

}  // namespace drape
