// Whether one step of a cloth is short enough for a device that all tenants share. Pure.
#pragma once

#include <cstddef>
#include <string>

#include "server/core/status.h"
#include "server/scene/scene_model.h"
#include "server/session/cloth_record.h"
#include "server/solver/step_settings.h"

namespace drape::api {

// INVALID_ARGUMENT naming `field`, the settings, above kMaxSolvesPerStep, or the colliders above
// kMaxParticleColliderPairs.
Status CheckStepCost(const std::string& field, const SceneModel& model,
                     const StepSettings& settings, size_t collider_count);

// The same for a cloth that `change` is applied to; names "spec.settings".
Status CheckStepCost(const ClothDescription& cloth, const ClothChange& change);
// And for one that gets another model by it.
Status CheckStepCost(const ClothDescription& cloth, const SceneModel& model,
                     const ClothChange& change);

}  // namespace drape::api
