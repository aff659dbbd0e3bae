// From the rest-length controls of a request to those of the scheduler.
#pragma once

#include <span>
#include <vector>

#include "server/core/status.h"
#include "server/scheduler/step_work.h"
#include "server/session/cloth_record.h"

namespace drape {

// A row of RestLengthControls as the client sees it.
struct RestLengthRow {
  ClothId cloth;
  uint32_t constraint = 0;  // in the order of the description
  double length_m = 0;      // > 0
  double over_s = 0;        // >= 0
};

// A row of RestLengthScales.
struct RestLengthScaleRow {
  ClothId cloth;
  double scale = 1;   // > 0
  double over_s = 0;  // >= 0
};

// Finds the cloth of each row among the request's cloths. INVALID_ARGUMENT names
// "rest_length_controls.cloth_ids[r]" (not a cloth of the request),
// "rest_length_controls.constraints[r]" (no such constraint, or one between two pins),
// "rest_length_scales.cloth_ids[r]" (named before: a row costs a pass over its cloth),
// "rest_length_scales.scales[r]" (a length below the least) and so on. Takes time in proportion to
// the rows and to the constraints of the cloths that they name. Pure.
Result<std::vector<LengthControl>> MapLengthControls(
    std::span<const RestLengthRow> rows, std::span<const std::shared_ptr<ClothRecord>> cloths);
Result<std::vector<LengthScale>> MapLengthScales(
    std::span<const RestLengthScaleRow> rows, std::span<const std::shared_ptr<ClothRecord>> cloths);

}  // namespace drape
