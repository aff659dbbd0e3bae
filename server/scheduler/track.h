// The motions of all pins, of all rest lengths or of all colliders of one cloth.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "server/core/check.h"
#include "server/scheduler/motion.h"

namespace drape {

// Not thread-safe.
template <class Value>
class Track {
 public:
  // One motion per element. `is_settled`: the backend has every goal already.
  void Start(std::vector<Motion<Value>> motions, bool is_settled) {
    motions_ = std::move(motions);
    is_settled_ = is_settled || motions_.empty();
    is_repeated_ = false;
  }
  // The same motions as a track had that was `is_settled` and `is_repeated`.
  void Restore(std::vector<Motion<Value>> motions, bool is_settled, bool is_repeated) {
    Start(std::move(motions), is_settled);
    is_repeated_ = is_repeated && !is_settled_;
  }
  void Set(size_t k, Motion<Value> motion) {
    DRAPE_CHECK(k < motions_.size(), "no such element");
    motions_[k] = std::move(motion);
    is_settled_ = is_repeated_ = false;
  }
  // Element k leaves for `goal` at `now_s` from where it is then, over `over_s` seconds.
  void Move(size_t k, const Value& goal, double over_s, double now_s) {
    Set(k, {motion(k).At(now_s), goal, now_s, over_s});
  }

  size_t size() const { return motions_.size(); }
  bool empty() const { return motions_.empty(); }
  const Motion<Value>& motion(size_t k) const {
    DRAPE_CHECK(k < motions_.size(), "no such element");
    return motions_[k];
  }
  uint64_t held_bytes() const { return motions_.size() * (sizeof(Motion<Value>) + sizeof(Value)); }
  // Whether every motion is over and the backend has been told.
  bool is_settled() const { return is_settled_; }
  // Whether it would be settled but for SendAgain.
  bool is_repeated() const { return is_repeated_; }
  // Every value itself, not the targets (Motion::At).
  std::vector<Value> At(double time_s) const {
    std::vector<Value> values;
    values.reserve(motions_.size());
    for (const Motion<Value>& motion : motions_) values.push_back(motion.At(time_s));
    return values;
  }

  // The next step gets every target, even if it has had them: the backend may have dropped it. That
  // alone is no news.
  void SendAgain() {
    is_repeated_ |= is_settled_;
    is_settled_ = motions_.empty();
  }

  // Every target of a step that ends at `end_s`, or nothing if none has changed since the last
  // step. Valid until the next call.
  std::span<const Value> TargetsForStep(double end_s) {
    has_news_ = !is_settled_ && !is_repeated_;
    if (is_settled_) return {};
    is_repeated_ = false;
    targets_.clear();
    for (const Motion<Value>& motion : motions_) targets_.push_back(motion.TargetAt(end_s));
    is_settled_ = std::all_of(motions_.begin(), motions_.end(),
                              [&](const Motion<Value>& motion) { return motion.IsOver(end_s); });
    return targets_;
  }
  // Whether that step has targets that the one before had not.
  bool has_news() const { return has_news_; }

 private:
  std::vector<Motion<Value>> motions_;
  std::vector<Value> targets_;
  bool is_settled_ = true;
  bool is_repeated_ = false;  // what is not settled was so before SendAgain
  bool has_news_ = false;
};

}  // namespace drape
