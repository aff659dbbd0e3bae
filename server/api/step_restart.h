// Cloths that start again, or go on from what was saved, as part of a Step: StepResets, StepLoads.
#pragma once

#include <memory>
#include <vector>

#include "server/api/request_validation.h"
#include "server/scheduler/step_work.h"
#include "server/session/session.h"

namespace drape::api {

// [cloth] what a cloth becomes before its controls act, null where it keeps its own; or empty.
using Descriptions = std::vector<std::shared_ptr<const ClothDescription>>;

// Sets StepWork::restart and restarts. INVALID_ARGUMENT ("resets.cloth_ids[r]",
// "loads.cloth_ids[r]") for what is no cloth of the request, occurs twice, cannot become what
// was saved, or starts more again than a step may; NOT_FOUND (SAVED_STATES_NOT_FOUND).
Result<Descriptions> AddRestarts(const CheckedStep& checked, const Session& session,
                                 const ClothList& cloths, StepWork& work);

}  // namespace drape::api
