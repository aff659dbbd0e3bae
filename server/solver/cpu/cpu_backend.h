// The single-precision backend on all cores: equal cloths side by side in the lanes of the vector
// registers, others alone, big ones among these by several threads together.
#pragma once

#include <cstdint>
#include <memory>

#include "server/solver/backend.h"

namespace drape {

struct CpuBackendOptions {
  // Threads that step cloths, including the calling one; 0 = one per core. The result does not
  // depend on it.
  uint32_t thread_count = 0;
};

// Switches for tests and measurements. The result does not depend on them.
struct CpuBackendTesting {
  bool use_lanes = true;            // step equal cloths side by side
  bool leave_out_colliders = true;  // those that a cloth cannot reach within a step
};

// Named "cpu". Plan "lanes": cloths are stepped side by side wherever the batch has several that
// are alike (side_by_side/group_step.h); "single": always alone, on a machine without lanes.
std::unique_ptr<Backend> CreateCpuBackend(const CpuBackendOptions& options = {},
                                          const CpuBackendTesting& testing = {});

}  // namespace drape
