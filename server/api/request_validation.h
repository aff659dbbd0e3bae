// From requests to plain values, or INVALID_ARGUMENT with every violation. Pure: knows no session.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drape/v1/cloths.pb.h"
#include "drape/v1/simulation_service.pb.h"
#include "drape/v1/step.pb.h"
#include "server/api/cloth_selection.h"
#include "server/api/limits.h"
#include "server/api/view_validation.h"
#include "server/core/ids.h"
#include "server/core/status.h"
#include "server/scheduler/step_work.h"
#include "server/session/cloth_record.h"
#include "server/session/cloth_reset.h"
#include "server/session/control_rows.h"

namespace drape::api {

// A checked CreateClothsRequest; the model is not built yet.
struct CheckedCreation {
  std::shared_ptr<const ModelDescription> description;
  std::vector<Pin> pins;
  StepSettings settings;  // of the spec; a copy may have its own
  std::vector<ClothCopy> copies;
  std::string world{};  // ClothCreation::world
};
Result<CheckedCreation> CheckCreateCloths(const v1::CreateClothsRequest& request,
                                          const RequestLimits& limits);

Result<ClothChange> CheckUpdateCloths(const v1::UpdateClothsRequest& request,
                                      const RequestLimits& limits);

// A checked ResetClothsRequest.
struct CheckedReset {
  std::vector<ClothId> cloths;
  ClothStarts starts;
};
Result<CheckedReset> CheckReset(const v1::ResetClothsRequest& request);

// A name for saved states.
void CheckSavedName(const FieldPath& path, const std::string& name, Violations& violations);

// A checked StepLoads.
struct CheckedLoads {
  std::string name;
  std::vector<ClothId> cloths;
  std::vector<ClothId> saved;  // [cloth], or empty: each itself
};

// A checked StepRequest.
struct CheckedStep {
  std::vector<ClothId> cloths;
  std::optional<uint32_t> steps;
  std::optional<uint64_t> until_step;
  std::optional<uint64_t> expected_step;
  ControlRows controls;
  CheckedReset resets;  // no ids: none
  CheckedLoads loads;   // no cloths: none
  ViewSpec view;
  bool report = false;
  bool grip_states = false;
  bool impulses = false;
  bool contact_impulses = false;
};
Result<CheckedStep> CheckStep(const v1::StepRequest& request, uint32_t max_steps_per_request);

}  // namespace drape::api
