// The last resort if a server is told to stop and does not.
#pragma once

#include <signal.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

namespace drape {

// Ends the process with status 1 and a line in the log when `patience` is over or when it is told
// again to stop, by one of `signals` after the first `signals_left_out` of them, whichever is
// first. With `hurry` it is told twice: the first time `hurry` is called, from a thread of the
// guard. A signal within kRepetition of the last one that counted is that one again: process
// groups, `timeout` and supervisors send two. The signals must be blocked in every thread.
class StopGuard {
 public:
  static constexpr std::chrono::milliseconds kRepetition{1'000};

  StopGuard(const sigset_t& signals, std::chrono::milliseconds patience, int signals_left_out = 0,
            std::function<void()> hurry = {});
  // Work goes on: `patience` from now on, if that is later. Thread-safe.
  void Extend(std::chrono::milliseconds patience);
  // The server has stopped in time.
  ~StopGuard();
  StopGuard(const StopGuard&) = delete;
  StopGuard& operator=(const StopGuard&) = delete;

 private:
  void Watch();
  void Take(int signal);

  const sigset_t signals_;
  std::atomic<std::chrono::steady_clock::time_point> deadline_;
  // The thread's own.
  int signals_left_out_;
  std::function<void()> hurry_;  // none any more: it was called
  std::chrono::steady_clock::time_point told_at_;

  std::atomic<bool> is_done_ = false;
  std::thread thread_;
};

}  // namespace drape
