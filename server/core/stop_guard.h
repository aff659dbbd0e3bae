// The last resort when a server is told to stop and does not.
#pragma once

#include <signal.h>

#include <atomic>
#include <chrono>
#include <thread>

namespace drape {

// While one exists, the process ends at once with status 1 and a line in the log when `patience` is
// over, or when one of `signals` arrives. They must be blocked in every thread.
class StopGuard {
 public:
  StopGuard(const sigset_t& signals, std::chrono::milliseconds patience);
  // All went well: the guard does nothing more.
  ~StopGuard();
  StopGuard(const StopGuard&) = delete;
  StopGuard& operator=(const StopGuard&) = delete;

 private:
  void Watch() const;

  const sigset_t signals_;
  const std::chrono::steady_clock::time_point deadline_;
  std::atomic<bool> is_done_ = false;
  std::thread thread_;
};

}  // namespace drape
