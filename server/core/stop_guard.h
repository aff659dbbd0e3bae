// The last resort if a server is told to stop and does not.
#pragma once

#include <signal.h>

#include <atomic>
#include <chrono>
#include <thread>

namespace drape {

// Ends the process with status 1 and a line in the log when `patience` is over or when one of
// `signals` arrives after the first `signals_left_out` of them, whichever is first. The signals
// must be blocked in every thread.
class StopGuard {
 public:
  StopGuard(const sigset_t& signals, std::chrono::milliseconds patience, int signals_left_out = 0);
  // Work goes on: `patience` from now on, if that is later. Thread-safe.
  void Extend(std::chrono::milliseconds patience);
  // The server has stopped in time.
  ~StopGuard();
  StopGuard(const StopGuard&) = delete;
  StopGuard& operator=(const StopGuard&) = delete;

 private:
  void Watch() const;

  const sigset_t signals_;
  std::atomic<std::chrono::steady_clock::time_point> deadline_;
  const int signals_left_out_;
  std::atomic<bool> is_done_ = false;
  std::thread thread_;
};

}  // namespace drape
