// Cloths at rest sleep: their steps are complete without being computed.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/solver/backend.h"
#include "server/solver/step_report.h"
#include "server/solver/step_settings.h"

namespace drape {

// Watches one cloth by looking at its positions now and then. Where no look finds a particle
// farther than settings.sleep_motion_m from where it was when the watch began, the cloth falls
// asleep with the last look and stays as it is until Wake. A function of what the cloth's own steps
// did, so that nothing depends on what else is in a batch. Device thread.
class SleepWatch {
 public:
  // Wakes.
  void Set(const StepSettings& settings);
  // Something acts on the cloth: it is awake, and watched from the beginning.
  void Wake();

  bool is_asleep() const { return is_asleep_; }
  // Needs is_asleep(): what each step reports, measured; no sweeps.
  const StepReport& report() const { return report_; }

  // Whether the next step decides, and so has to be measured.
  bool decides_next() const;
  // Takes in a step that was computed.
  void CompleteStep(const StepReport& report);
  // The state after that step is to be looked at, before the next step.
  bool wants_look() const { return wants_look_; }
  // The positions are rows [first_row, first_row + row_count) of the column.
  void Look(const ScalarColumn& positions_m, size_t first_row, size_t row_count);

 private:
  uint64_t NextLook() const;
  bool HasMoved(const ScalarColumn& positions_m, size_t first_row) const;
  void Anchor(const ScalarColumn& positions_m, size_t first_row, size_t row_count);

  StepSettings settings_;
  uint64_t stride_ = 1;  // steps in 1/60 s
  bool is_asleep_ = false;
  bool wants_look_ = false;
  bool has_anchor_ = false;
  ScalarColumn anchor_m_;  // positions at the beginning of the watch
  uint64_t steps_ = 0;     // since then, or since the last look that saw the cloth move
  size_t looks_ = 0;       // since then
  uint64_t patience_ = 0;  // steps until the next beginning
  StepReport report_;
};

}  // namespace drape
