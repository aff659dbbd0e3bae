// The single-precision backend on all cores: plain float, one cloth per task.
#pragma once

#include <cstdint>
#include <memory>

#include "server/solver/backend.h"

namespace drape {

struct CpuBackendOptions {
  // Threads that step cloths, the calling one included; 0 = one per core. The result does not
  // depend on it.
  uint32_t thread_count = 0;
};

// Named "cpu"; every model runs as plan "scalar".
std::unique_ptr<Backend> CreateCpuBackend(const CpuBackendOptions& options = {});

}  // namespace drape
