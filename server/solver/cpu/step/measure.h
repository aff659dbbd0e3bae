// The measured values of a report, from a committed state.
#pragma once

#include <span>

#include "server/solver/cpu/step/step_context.h"
#include "server/solver/self_contact/crossing_search.h"
#include "server/solver/step_report.h"

namespace drape::cpu {

// Measures `state` in double precision, summed in order of particles and constraints. Without a
// fault it is the outcome of the step whose impulses are still in context.scratch, and so is the
// state at the start of that step; with one it is the last good state, which has no residual and
// did not move.
// Without contacts with itself and others.
Measurements Measure(const StepContext& context, const FloatState& state, FaultReason fault);

struct MeasuredCloth {
  const StepContext& context;
  const FloatState& state;
};

// What there is to tell of the contacts of cloths with themselves and with each other: of one
// cloth, or of all of a world in its order. Empty: they touch nothing.
std::vector<self_contact::SelfContactMeasures> MeasureSelfContacts(
    std::span<const MeasuredCloth> cloths);

}  // namespace drape::cpu
