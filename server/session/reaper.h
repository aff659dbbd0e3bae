// The thread that ends sessions that are no longer used.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "server/session/session_registry.h"

namespace drape {

// Calls registry.ReapExpired() every `interval` of real time until destroyed, and gets back the
// reserve of memory that was given up (core/memory_reserve.h). The registry outlives it.
class Reaper {
 public:
  explicit Reaper(SessionRegistry& registry,
                  std::chrono::milliseconds interval = std::chrono::seconds(1));
  ~Reaper();
  Reaper(const Reaper&) = delete;
  Reaper& operator=(const Reaper&) = delete;

 private:
  void Loop(std::chrono::milliseconds interval);
  void LookAtMemory();

  SessionRegistry& registry_;
  uint64_t seen_times_ = 0;  // MemoryReserve::times_used
  std::mutex mutex_;
  std::condition_variable wake_;
  bool is_stopping_ = false;
  std::thread thread_;
};

}  // namespace drape
