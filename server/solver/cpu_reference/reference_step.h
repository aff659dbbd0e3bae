// One time step of one cloth, written from the equations in server/solver/method.md.
#pragma once

#include <cstdint>

#include "server/solver/cpu_reference/reference_cloth.h"
#include "server/solver/step_report.h"

namespace drape {

// Steps the cloth, its pins to pin_targets_m, by at most max_iterations sweeps per substep. A cloth
// that is faulted, or becomes so, keeps its state.
StepReport StepReferenceCloth(ReferenceCloth& cloth, bool measure, uint32_t max_iterations);

}  // namespace drape
