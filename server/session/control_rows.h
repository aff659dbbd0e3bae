// From the controls of a request, as the client names them, to those of the scheduler.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/core/ids.h"
#include "server/core/status.h"
#include "server/scheduler/step_controls.h"
#include "server/session/cloth_record.h"

namespace drape {

// A row of a table of controls. Environment frame.
template <class Control>
struct ControlRow {
  ClothId cloth;
  Control control;
};

// One member per table of StepRequest.
struct ControlRows {
  std::vector<ControlRow<PinControl>> pins{};
  std::vector<ControlRow<ColliderControl>> colliders{};
  std::vector<ControlRow<LengthControl>> lengths{};
  std::vector<ControlRow<LengthScale>> length_scales{};
  std::vector<ControlRow<GripControl>> grips{};
};

// Finds the cloth of each row among the request's cloths and brings the control into its frame.
// INVALID_ARGUMENT names every wrong row (at most 16) of the first table that has one:
//   "<table>.cloth_ids[r]": not a cloth of the request, or a cloth that is scaled twice
//   "pin_controls.particles[r]": not a pin
//   "collider_controls.colliders[r]": the cloth has fewer
//   "collider_controls.cloth_ids[r]": the cloths up to there cost too much (start_cost.h)
//   "rest_length_controls.constraints[r]": no such constraint, or one between two pins
//   "grip_controls.slots[r]": the cloth has fewer
//   "grip_controls.particles[r]": no such particle, or a pin
//   "grip_controls.actions[r]": the rows that search search too many particles
//   "rest_length_scales.scales[r]": makes a length that is too short or too long
//   "rest_length_controls.cloth_ids[r]", "rest_length_scales.cloth_ids[r]": the cloths up to there
//     have too many constraints
// `becoming`: [cloth] the description that a cloth gets before its controls act, null where it
// keeps its own; or empty. Takes time in proportion to the rows and to the constraints of the
// cloths that they name. Pure.
Result<StepControls> ResolveControls(
    const ControlRows& rows, std::span<const std::shared_ptr<ClothRecord>> cloths,
    std::span<const std::shared_ptr<const ClothDescription>> becoming = {});

}  // namespace drape
