// The motion of a driven value over time. Pure.
#pragma once

#include <optional>

#include "server/scene/rigid_motion.h"

namespace drape {

// The value `seconds` after `start` on the straight way to `goal`, which takes `over_s`.
template <class Value>
Value Between(const Value& start, const Value& goal, double seconds, double over_s) {
  return start + (goal - start) * (seconds / over_s);
}
// A body turns about one axis, the shorter way.
inline RigidMotion Between(const RigidMotion& start, const RigidMotion& goal, double seconds,
                           double over_s) {
  return start.Towards(goal, over_s).After(seconds);
}

// The value `seconds` after `start` if nothing drives it.
template <class Value>
Value After(const Value& start, double /*seconds*/) {
  return start;
}
inline RigidMotion After(const RigidMotion& start, double seconds) {
  return start.After(seconds);
}

// From `start` at start_s to `goal` at start_s + over_s; constant afterwards. Without a goal it
// continues with its own velocity. Any one frame.
template <class Value>
struct Motion {
  Value start;
  std::optional<Value> goal;
  double start_s = 0;
  double over_s = 0;  // >= 0; 0 = within one step

  bool IsOver(double time_s) const { return goal.has_value() && time_s >= start_s + over_s; }
  // The target of a step that ends at `time_s`: at or after the end exactly `goal`, bit for bit.
  Value TargetAt(double time_s) const {
    if (IsOver(time_s)) return *goal;
    if (time_s <= start_s) return start;
    const double seconds = time_s - start_s;
    return goal.has_value() ? Between(start, *goal, seconds, over_s) : After(start, seconds);
  }
  // The value itself. Unlike TargetAt it is `start` at start_s even if over_s is 0: the step that
  // takes it to the goal has not been done yet.
  Value At(double time_s) const { return time_s <= start_s ? start : TargetAt(time_s); }
};

}  // namespace drape
