// Other models for cloths that run: other pins, constraints, springs, joints or structural
// material.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/session/cloth_record.h"
#include "server/session/model_cache.h"

namespace drape {

// What a cloth is built from after a change of its structure.
struct ChangedModel {
  std::shared_ptr<const ModelDescription> description;
  std::shared_ptr<const SceneModel> model;
  std::string plan;  // BackendDescription::plan_of; the caller of BuildChangedModels sets it
};

// What a changed model must keep to.
struct ModelRules {
  // Of what the change brings. The number of particles stays, and other pins alone bring nothing.
  ModelLimits limits;
  // Asked for each cloth; an error refuses the change. Empty: everything is accepted.
  std::function<Status(const ClothDescription& before, const SceneModel& after)> accept;
};

// The models of the cloths after the change, [cloth_count]; cloths of one description share one.
// INVALID_ARGUMENT names the field ("spec.pins[2].particle",
// "spec.particles.distance_constraints[0].i") for what a cloth's description makes illegal, also
// connections for a cloth that is not made of particles. Any thread.
Result<std::vector<ChangedModel>> BuildChangedModels(
    std::span<const std::shared_ptr<ClothRecord>> cloths, const ClothChange& change,
    const ModelRules& rules, ModelCache& models);

}  // namespace drape
