// Monotonic time, which tests can advance by hand, and that of the calendar.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

namespace drape {

// Thread-safe. Microseconds since an arbitrary start; never decreases.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual int64_t NowUs() const = 0;
};

class SteadyClock final : public Clock {
 public:
  int64_t NowUs() const override {
    return std::chrono::duration_cast<std::chrono::microseconds>(
               std::chrono::steady_clock::now().time_since_epoch())
        .count();
  }
};

// Seconds since 1970, by the clock of the machine, which may be set.
inline double NowUnix_s() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration<double>(now).count();
}

class FakeClock final : public Clock {
 public:
  int64_t NowUs() const override { return now_us_.load(); }
  void AdvanceUs(int64_t us) { now_us_ += us; }

 private:
  std::atomic<int64_t> now_us_{0};
};

}  // namespace drape
