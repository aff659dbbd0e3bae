// From the pin controls of a request to those of the scheduler.
#pragma once

#include <span>
#include <vector>

#include "server/core/status.h"
#include "server/scheduler/step_work.h"
#include "server/session/cloth_record.h"

namespace drape {

// A row of PinControls as the client sees it.
struct PinControlRow {
  ClothId cloth;
  uint32_t particle = 0;
  Eigen::Vector3d target_m = Eigen::Vector3d::Zero();  // environment frame
  double over_s = 0;                                   // >= 0
};

// Finds the cloth of each row among the request's cloths and brings the target into its frame.
// INVALID_ARGUMENT names "pin_controls.cloth_ids[r]" (not a cloth of the request) or
// "pin_controls.particles[r]" (not a pin). Pure.
Result<std::vector<PinControl>> MapPinControls(
    std::span<const PinControlRow> rows, std::span<const std::shared_ptr<ClothRecord>> cloths);

}  // namespace drape
