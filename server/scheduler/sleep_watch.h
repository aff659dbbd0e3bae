// Cloths at rest sleep: their steps are complete without being computed.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/solver/backend.h"
#include "server/solver/step_report.h"
#include "server/solver/step_settings.h"

namespace drape {

// Watches one cloth. Its positions are looked at several times (kSleepLooks) within
// settings.sleep_after_s of simulated time. If no particle was ever farther than
// settings.sleep_motion_m from its position at the beginning of that time, the cloth falls asleep
// and stays as it is until Wake. Depends on the cloth's own steps only, never on the rest of a
// batch. Device thread.
class SleepWatch {
 public:
  // Where a watch is.
  struct State {
    bool is_asleep = false;
    bool wants_look = false;
    bool is_watching = false;
    ScalarColumn begin_m;   // positions at the beginning of the watch
    uint64_t steps = 0;     // since then, or since the last look that saw the cloth move
    size_t looks = 0;       // in this second
    uint64_t patience = 0;  // steps until the next second begins
    StepReport report;
  };

  // Wakes.
  void Set(const StepSettings& settings);
  // Something acts on the cloth: it is awake, and a new watch begins.
  void Wake();

  // Wakes, and does not watch for so many steps.
  void Wait(uint64_t patience);

  const State& state() const { return state_; }
  // Whether the next looks of both are due at the same time, and mean the same.
  bool IsAsFarAs(const SleepWatch& other) const;
  // Whether a watch of a cloth of so many particles, on a backend of this precision, can be so.
  static bool IsPossible(const State& state, ScalarType scalar, uint32_t particle_count);
  // Goes on from `state`, which IsPossible.
  void Restore(const StepSettings& settings, State state);

  bool is_asleep() const { return state_.is_asleep; }
  // Needs is_asleep(). The measured report of every step; no sweeps.
  const StepReport& report() const { return state_.report; }

  uint64_t held_bytes() const;
  // Whether the cloth may fall asleep after the next step, which must therefore be measured.
  bool decides_next() const;
  // A step of the cloth was computed.
  void CompleteStep(const StepReport& report);
  // Whether to Look at the positions before the next step.
  bool wants_look() const { return state_.wants_look; }
  // The cloth's positions are rows [first_row, first_row + row_count) of the column.
  void Look(const ScalarColumn& positions_m, size_t first_row, size_t row_count);

 private:
  uint64_t NextLook() const;
  bool HasMoved(const ScalarColumn& positions_m, size_t first_row) const;
  void BeginWatch(const ScalarColumn& positions_m, size_t first_row, size_t row_count);

  StepSettings settings_;
  uint64_t stride_ = 1;  // steps in 1/60 s
  State state_;
};

}  // namespace drape
