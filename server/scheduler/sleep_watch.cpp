#include "server/scheduler/sleep_watch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <variant>

#include "server/core/check.h"

namespace drape {
namespace {

// When to look, in sixtieths of sleep_after_s from the beginning. The first looks end the watch
// early for cloths that move. No vibration has a period that divides all of these, and a swing
// passes a position near its turning point only twice.
constexpr std::array<uint64_t, 8> kSleepLooks = {1, 3, 8, 15, 24, 35, 47, 60};
// The pause between two watched seconds of a moving cloth, in 1/60 s: it doubles up to a second, so
// that a cloth that never rests is read at most twice a second.
constexpr uint64_t kLeastPatience = 8;
constexpr uint64_t kMostPatience = 60;

template <class Scalar>
bool AnyBeyond(const std::vector<Scalar>& begin, const std::vector<Scalar>& now, size_t first,
               double most_m) {
  for (size_t k = 0; k < begin.size(); k += 3) {
    double distance_sq = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      const double change_m = double{now[first + k + axis]} - double{begin[k + axis]};
      distance_sq += change_m * change_m;
    }
    if (!(distance_sq <= most_m * most_m)) return true;
  }
  return false;
}

}  // namespace

void SleepWatch::Set(const StepSettings& settings) {
  settings_ = settings;
  stride_ =
      std::max<uint64_t>(1, static_cast<uint64_t>(std::lround(1 / (60 * settings.time_step_s))));
  Wake();
}

void SleepWatch::Wake() {
  is_asleep_ = false;
  wants_look_ = false;
  is_watching_ = false;
  begin_m_ = {};
  steps_ = 0;
  looks_ = 0;
  patience_ = kLeastPatience * stride_;
}

uint64_t SleepWatch::NextLook() const {
  if (!is_watching_) return patience_;
  const double steps = static_cast<double>(kSleepLooks[looks_] * stride_) * settings_.sleep_after_s;
  return std::max<uint64_t>(looks_ + 1, static_cast<uint64_t>(std::lround(steps)));
}

uint64_t SleepWatch::held_bytes() const {
  return std::visit([](const auto& values) { return values.size() * sizeof(values[0]); }, begin_m_);
}

bool SleepWatch::decides_next() const {
  return settings_.sleep_motion_m > 0 && !is_asleep_ && is_watching_ &&
         looks_ + 1 == kSleepLooks.size() && steps_ + 1 == NextLook();
}

void SleepWatch::CompleteStep(const StepReport& report) {
  DRAPE_CHECK(!is_asleep_ && !wants_look_, "Look comes before the next step");
  if (settings_.sleep_motion_m == 0 || report.fault != FaultReason::kNone) return;
  if (decides_next()) report_ = report;
  ++steps_;
  wants_look_ = steps_ == NextLook();
}

void SleepWatch::Look(const ScalarColumn& positions_m, size_t first_row, size_t row_count) {
  DRAPE_CHECK(wants_look_, "no look is due");
  wants_look_ = false;
  if (!is_watching_) {
    BeginWatch(positions_m, first_row, row_count);
  } else if (HasMoved(positions_m, first_row)) {
    const uint64_t patience = std::min(2 * patience_, kMostPatience * stride_);
    Wake();
    patience_ = patience;
  } else if (++looks_ == kSleepLooks.size()) {
    is_asleep_ = true;
    begin_m_ = {};
    report_.iterations = 0;
    report_.is_asleep = true;
  }
}

void SleepWatch::BeginWatch(const ScalarColumn& positions_m, size_t first_row, size_t row_count) {
  begin_m_ = std::visit(
      [&](const auto& values) -> ScalarColumn {
        const auto begin = values.begin() + static_cast<std::ptrdiff_t>(3 * first_row);
        return std::decay_t<decltype(values)>(begin,
                                              begin + static_cast<std::ptrdiff_t>(3 * row_count));
      },
      positions_m);
  is_watching_ = true;
  steps_ = 0;
}

bool SleepWatch::HasMoved(const ScalarColumn& positions_m, size_t first_row) const {
  return std::visit(
      [&](const auto& values) {
        using Values = std::decay_t<decltype(values)>;
        return AnyBeyond(std::get<Values>(begin_m_), values, 3 * first_row,
                         settings_.sleep_motion_m);
      },
      positions_m);
}

}  // namespace drape
