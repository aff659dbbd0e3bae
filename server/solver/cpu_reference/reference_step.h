// One time step of one cloth, written from the equations in server/solver/method.md.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "server/solver/cpu_reference/reference_cloth.h"
#include "server/solver/pause.h"
#include "server/solver/step_report.h"

namespace drape {

// What a report of a step is to tell.
struct AskedOfStep {
  bool measure = false;   // StepReport::measured
  bool impulses = false;  // StepReport::impulses
};

// A step of the cloth, its pins to pin_targets_m, by at most max_iterations sweeps per substep,
// which may be done in pieces. The cloth outlives it and is changed by nobody else meanwhile.
class ReferenceStep {
 public:
  ReferenceStep(ReferenceCloth& cloth, const AskedOfStep& asked, uint32_t max_iterations);
  ~ReferenceStep();

  // Begins or goes on until `pause` is due; none: it paused, and the cloth is as before. A cloth
  // that is faulted, or becomes so, keeps its state.
  std::optional<StepReport> Continue(const Pause& pause);

 private:
  struct UnderWay;

  ReferenceCloth& cloth_;
  const AskedOfStep asked_;
  const uint32_t max_iterations_;
  bool has_gained_energy_ = false;       // once: then it is done again by the calmer scheme
  std::unique_ptr<UnderWay> under_way_;  // null: the cloth is faulted
};

// The whole step at once.
StepReport StepReferenceCloth(ReferenceCloth& cloth, const AskedOfStep& asked,
                              uint32_t max_iterations);

}  // namespace drape
