#include "server/scheduler/sleep_watch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
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

bool SleepWatch::IsPossible(const State& state, ScalarType scalar, uint32_t particle_count) {
  if (state.patience == 0 || state.wants_look) return false;  // it looks at the end of its step
  if (state.is_asleep) return state.is_watching && state.looks == kSleepLooks.size();
  if (state.looks >= kSleepLooks.size()) return false;
  if (!state.is_watching) return state.looks == 0;
  const bool is_double = std::holds_alternative<std::vector<double>>(state.begin_m);
  const size_t numbers = std::visit([](const auto& v) { return v.size(); }, state.begin_m);
  return is_double == (scalar == ScalarType::kFloat64) && numbers == 3 * size_t{particle_count};
}

void SleepWatch::Restore(const StepSettings& settings, State state) {
  Set(settings);
  state_ = std::move(state);
}

void SleepWatch::Wake() {
  state_.is_asleep = false;
  state_.wants_look = false;
  state_.is_watching = false;
  state_.begin_m = {};
  state_.steps = 0;
  state_.looks = 0;
  state_.patience = kLeastPatience * stride_;
  state_.report = {};  // of pins and colliders that may be others now
}

void SleepWatch::Wait(uint64_t patience) {
  Wake();
  state_.patience = patience;
}

bool SleepWatch::IsAsFarAs(const SleepWatch& other) const {
  const State& a = state_;
  const State& b = other.state_;
  return std::tie(a.is_asleep, a.wants_look, a.is_watching, a.steps, a.looks, a.patience) ==
         std::tie(b.is_asleep, b.wants_look, b.is_watching, b.steps, b.looks, b.patience);
}

uint64_t SleepWatch::NextLook() const {
  if (!state_.is_watching) return state_.patience;
  const double steps =
      static_cast<double>(kSleepLooks[state_.looks] * stride_) * settings_.sleep_after_s;
  return std::max<uint64_t>(state_.looks + 1, static_cast<uint64_t>(std::lround(steps)));
}

uint64_t SleepWatch::held_bytes() const {
  return std::visit([](const auto& values) { return values.size() * sizeof(values[0]); },
                    state_.begin_m);
}

bool SleepWatch::decides_next() const {
  return settings_.sleep_motion_m > 0 && !state_.is_asleep && state_.is_watching &&
         state_.looks + 1 == kSleepLooks.size() && state_.steps + 1 == NextLook();
}

void SleepWatch::CompleteStep(const StepReport& report) {
  DRAPE_CHECK(!state_.is_asleep && !state_.wants_look, "Look comes before the next step");
  if (settings_.sleep_motion_m == 0 || report.fault != FaultReason::kNone) return;
  if (decides_next()) state_.report = report;
  ++state_.steps;
  state_.wants_look = state_.steps == NextLook();
}

void SleepWatch::Look(const ScalarColumn& positions_m, size_t first_row, size_t row_count) {
  DRAPE_CHECK(state_.wants_look, "no look is due");
  state_.wants_look = false;
  if (!state_.is_watching) {
    BeginWatch(positions_m, first_row, row_count);
  } else if (HasMoved(positions_m, first_row)) {
    Wait(std::min(2 * state_.patience, kMostPatience * stride_));
  } else if (++state_.looks == kSleepLooks.size()) {
    state_.is_asleep = true;
    state_.begin_m = {};
    state_.report.iterations = 0;
    state_.report.is_asleep = true;
  }
}

void SleepWatch::BeginWatch(const ScalarColumn& positions_m, size_t first_row, size_t row_count) {
  state_.begin_m = std::visit(
      [&](const auto& values) -> ScalarColumn {
        const auto begin = values.begin() + static_cast<std::ptrdiff_t>(3 * first_row);
        return std::decay_t<decltype(values)>(begin,
                                              begin + static_cast<std::ptrdiff_t>(3 * row_count));
      },
      positions_m);
  state_.is_watching = true;
  state_.steps = 0;
}

bool SleepWatch::HasMoved(const ScalarColumn& positions_m, size_t first_row) const {
  return std::visit(
      [&](const auto& values) {
        using Values = std::decay_t<decltype(values)>;
        return AnyBeyond(std::get<Values>(state_.begin_m), values, 3 * first_row,
                         settings_.sleep_motion_m);
      },
      positions_m);
}

}  // namespace drape
