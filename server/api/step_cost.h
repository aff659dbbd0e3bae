// Whether one step of a cloth is short enough for a device that all sessions share. Pure.
#pragma once

#include <cstddef>
#include <string>

#include "server/core/status.h"
#include "server/scene/scene_model.h"
#include "server/session/cloth_record.h"
#include "server/solver/step_settings.h"

namespace drape::api {

// INVALID_ARGUMENT naming `field`, the settings, above kMaxSolvesPerStep; naming the colliders
// above kMaxParticleColliderPairs.
Status CheckStepCost(const std::string& field, const SceneModel& model,
                     const StepSettings& settings, size_t collider_count);

// The same for a cloth after `change`; names "spec.settings".
Status CheckStepCost(const ClothDescription& cloth, const ClothChange& change);
// The same for a cloth to which `change` gives another model.
Status CheckStepCost(const ClothDescription& cloth, const SceneModel& model,
                     const ClothChange& change);

}  // namespace drape::api
