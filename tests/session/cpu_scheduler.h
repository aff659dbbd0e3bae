// A scheduler with the cpu backend, for tests of sessions on a real one.
#pragma once

#include <memory>

#include "server/core/clock.h"
#include "server/scheduler/scheduler.h"
#include "server/solver/cpu/cpu_backend.h"

namespace drape {

// One thread steps: what oneTBB does between its threads ThreadSanitizer cannot see, and reports.
inline std::unique_ptr<Scheduler> StartCpuScheduler(const Clock& clock) {
  const auto create = []() -> Result<std::unique_ptr<Backend>> {
    return CreateCpuBackend({.thread_count = 1});
  };
  return Scheduler::Start(create, {}, clock).value();
}

}  // namespace drape
