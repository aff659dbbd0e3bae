// New models for live cloths: other pins, constraints, springs, joints or structural material.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/session/cloth_record.h"
#include "server/session/model_cache.h"

namespace drape {

// The new model of a cloth after a change of its structure.
struct ChangedModel {
  // The version that it was made for: while this object exists, no other one has its address.
  std::shared_ptr<const ModelDescription> before;
  std::shared_ptr<const ModelDescription> description;
  std::shared_ptr<const SceneModel> model;
  std::shared_ptr<const void> charge;  // SharedModel
};

// The rules that a changed model must obey.
struct ModelRules {
  // Limits on what the change adds. It never adds particles, and other pins alone add nothing.
  ModelLimits limits;
  // Called for each cloth with its description of the moment: early, and again on the device thread
  // when the change is made. Cheap and pure; an error refuses the change. Empty: every change is
  // accepted.
  std::function<Status(const ClothDescription& before, const SceneModel& after)> accept;
};

// The models of the cloths after the change, [cloth_count]; cloths of one description share one.
// INVALID_ARGUMENT names the field ("spec.pins[2].particle",
// "spec.particles.distance_constraints[0].i") for values that are illegal for a cloth's
// description, such as connections for a cloth that is not made of particles. RESOURCE_EXHAUSTED
// (QUOTA_EXCEEDED) if `owner` may not have so many. `interruption`: asked now and then; null:
// nobody is. Any thread.
Result<std::vector<ChangedModel>> BuildChangedModels(
    std::span<const std::shared_ptr<ClothRecord>> cloths, const ClothChange& change,
    const ModelRules& rules, const std::string& owner, ModelCache& models,
    Interruption* interruption = nullptr);

}  // namespace drape
