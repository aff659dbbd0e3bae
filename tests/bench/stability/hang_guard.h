// Ends the process if something that should take seconds does not end.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace drape::bench {

class HangGuard {
 public:
  explicit HangGuard(double limit_s);
  ~HangGuard();

  // Restarts the limit, for this.
  void Watch(const std::string& what);

 private:
  void Run();

  const std::chrono::duration<double> limit_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::string what_;                                // guarded by mutex_
  std::chrono::steady_clock::time_point deadline_;  // guarded by mutex_
  bool is_over_ = false;                            // guarded by mutex_
  std::thread thread_;
};

}  // namespace drape::bench
