// Where a step that is done in pieces may pause.
#pragma once

#include <chrono>
#include <optional>

namespace drape {

// Asked after every sweep and every substep. The time is that of the machine, whatever clock the
// scheduler has: it bounds how long a device is kept from others, and no result depends on it.
class Pause {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  static Pause Never() { return Pause(std::nullopt); }
  static Pause At(TimePoint time) { return Pause(time); }

  bool is_never() const { return !at_.has_value(); }
  bool IsDue() const { return at_.has_value() && std::chrono::steady_clock::now() >= *at_; }

 private:
  explicit Pause(std::optional<TimePoint> at) : at_(at) {}

  const std::optional<TimePoint> at_;
};

}  // namespace drape
