// From the collider controls of a request to those of the scheduler.
#pragma once

#include <span>
#include <vector>

#include "server/core/status.h"
#include "server/scheduler/step_work.h"
#include "server/session/cloth_record.h"

namespace drape {

// A row of ColliderControls as the client sees it.
struct ColliderControlRow {
  ClothId cloth;
  uint32_t collider = 0;
  ColliderTarget target{};  // environment frame
  double over_s = 0;        // >= 0
};

// Finds the cloth of each row among the request's cloths and brings the target into its frame.
// INVALID_ARGUMENT names "collider_controls.cloth_ids[r]" (not a cloth of the request) or
// "collider_controls.colliders[r]" (the cloth has fewer). Pure.
Result<std::vector<ColliderControl>> MapColliderControls(
    std::span<const ColliderControlRow> rows, std::span<const std::shared_ptr<ClothRecord>> cloths);

}  // namespace drape
