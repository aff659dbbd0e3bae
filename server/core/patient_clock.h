// Time that stands still while the process does.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

#include "server/core/clock.h"

namespace drape {

// Monotonic like `clock`, but a time in which this process was stopped (SIGSTOP, a paused virtual
// machine, a swapped-out container) does not count: leases must not run out while nobody could
// renew them. A thread looks at the clock every kBeat_us. Where nobody has for more than
// kMostGap_us the process stood still, and only a beat counts, which may have passed before. So a
// stop takes kMostGap_us from a lease at most; threads that are late make time slower, which does
// no harm. Thread-safe.
class PatientClock final : public Clock {
 public:
  static constexpr int64_t kBeat_us = 50'000;
  static constexpr int64_t kMostGap_us = 200'000;

  // `clock` outlives this.
  explicit PatientClock(const Clock& clock) : clock_(clock), last_us_(clock.NowUs()) {
    thread_ = std::thread([this] { Loop(); });
  }
  ~PatientClock() override {
    {
      const std::lock_guard lock(mutex_);
      is_stopping_ = true;
    }
    wake_.notify_one();
    thread_.join();
  }

  int64_t NowUs() const override {
    const std::lock_guard lock(mutex_);
    return Look();
  }

 private:
  // With mutex_ held.
  int64_t Look() const {
    const int64_t now_us = clock_.NowUs();
    const int64_t gap_us = now_us - last_us_;
    if (gap_us > kMostGap_us) left_out_us_ += gap_us - kBeat_us;
    last_us_ = now_us;
    return now_us - left_out_us_;
  }

  void Loop() {
    std::unique_lock lock(mutex_);
    while (!wake_.wait_for(lock, std::chrono::microseconds(kBeat_us),
                           [this] { return is_stopping_; })) {
      Look();
    }
  }

  const Clock& clock_;
  mutable std::mutex mutex_;
  mutable int64_t last_us_;  // when it was last looked at
  mutable int64_t left_out_us_ = 0;
  std::condition_variable wake_;
  bool is_stopping_ = false;
  std::thread thread_;
};

}  // namespace drape
