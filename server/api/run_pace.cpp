#include "server/api/run_pace.h"

#include <algorithm>
#include <cmath>

namespace drape::api {

bool RunPace::IsDue(int64_t now_us) {
  if (is_paused()) return false;
  if (interval_us_ == 0) return true;
  // Step k is too late once k * interval < elapsed - max_behind.
  const int64_t oldest_us = Elapsed_us(now_us) - max_behind_us_;
  if (oldest_us > 0) {
    const auto first =
        static_cast<uint64_t>(std::ceil(static_cast<double>(oldest_us) / interval_us_));
    if (first > next_) {
      dropped_ += first - next_;
      next_ = first;
    }
  }
  return Waiting(now_us) > 0;
}

std::optional<int64_t> RunPace::NextDue_us() const {
  if (is_paused()) return std::nullopt;
  return begin_us_ + static_cast<int64_t>(std::ceil(static_cast<double>(next_) * interval_us_));
}

uint64_t RunPace::Waiting(int64_t now_us) const {
  if (interval_us_ == 0) return 0;
  const uint64_t due = DueBy(Elapsed_us(now_us));
  return due > next_ ? due - next_ : 0;
}

void RunPace::SetPaused(bool is_paused, int64_t now_us) {
  if (is_paused == this->is_paused()) return;
  if (is_paused) {
    paused_at_us_ = now_us;
  } else {
    begin_us_ += now_us - *paused_at_us_;
    paused_at_us_.reset();
  }
}

int64_t RunPace::Elapsed_us(int64_t now_us) const {
  return std::max<int64_t>(paused_at_us_.value_or(now_us) - begin_us_, 0);
}

uint64_t RunPace::DueBy(int64_t elapsed_us) const {
  return static_cast<uint64_t>(std::floor(static_cast<double>(elapsed_us) / interval_us_)) + 1;
}

}  // namespace drape::api
