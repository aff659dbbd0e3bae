// Where a step that is done in pieces may pause.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace drape {

// Asked after every sweep and every substep, and within stages that may take long (Interruption).
// The time is that of the machine, whatever clock the scheduler has: it bounds how long a device is
// kept from others, and no result depends on it.
class Pause {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  static Pause Never() { return Pause(std::nullopt); }
  static Pause At(TimePoint time) { return Pause(time); }
  static Pause After_us(int64_t duration_us) {
    return Pause(std::chrono::steady_clock::now() + std::chrono::microseconds(duration_us));
  }

  bool is_never() const { return !at_.has_value(); }
  bool IsDue() const { return at_.has_value() && std::chrono::steady_clock::now() >= *at_; }

 private:
  explicit Pause(std::optional<TimePoint> at) : at_(at) {}

  std::optional<TimePoint> at_;
};

}  // namespace drape
