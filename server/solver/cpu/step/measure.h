// The measured values of a report, from a committed state.
#pragma once

#include "server/solver/cpu/step/step_context.h"
#include "server/solver/step_report.h"

namespace drape::cpu {

// Measures `state` in double precision, summed in order of particles and constraints. Without a
// fault it is the outcome of the step whose impulses are still in context.scratch, and so is the
// state at the start of that step; with one it is the last good state, which has no residual and
// did not move.
Measurements Measure(const StepContext& context, const FloatState& state, FaultReason fault);

}  // namespace drape::cpu
