// When the steps of a run are due, which of them are too late. Pure.
#pragma once

#include <cstdint>
#include <optional>

namespace drape::api {

// Step k of a run is due at begin + k * interval of wall time, pauses left out. One that has not
// begun `max_behind` after that is dropped: the run does not make it, so simulated time falls
// behind. What is late by less is caught up. Times by one clock [us].
class RunPace {
 public:
  // `interval_us` > 0; 0: unpaced, always due.
  RunPace(double interval_us, int64_t max_behind_us, int64_t begin_us)
      : interval_us_(interval_us), max_behind_us_(max_behind_us), begin_us_(begin_us) {}

  // Whether a step is due now. Drops those that are too late.
  bool IsDue(int64_t now_us);
  // A step that was due has begun.
  void Begin() { ++next_; }
  // When the next one will be due; none: it is paused.
  std::optional<int64_t> NextDue_us() const;
  // Steps due by now that have neither begun nor been dropped.
  uint64_t Waiting(int64_t now_us) const;
  uint64_t dropped() const { return dropped_; }

  // Nothing becomes due, or late, during a pause.
  void SetPaused(bool is_paused, int64_t now_us);
  bool is_paused() const { return paused_at_us_.has_value(); }
  // Wall time of the run without pauses.
  int64_t Elapsed_us(int64_t now_us) const;

 private:
  // The steps that are due by a time of the run itself, from the first one on.
  uint64_t DueBy(int64_t elapsed_us) const;

  const double interval_us_;
  const int64_t max_behind_us_;
  int64_t begin_us_;      // moved by pauses
  uint64_t next_ = 0;     // the first step that has not begun
  uint64_t dropped_ = 0;  // of those before
  std::optional<int64_t> paused_at_us_;
};

}  // namespace drape::api
