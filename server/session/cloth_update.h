// Changing live cloths: all of them or none.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "server/session/cloth_record.h"
#include "server/session/model_change.h"
#include "server/solver/backend.h"

namespace drape {

// Applies the change to all the cloths or to none. `models`: [cloth_count] if change.needs_model(),
// otherwise empty. NOT_FOUND if one of them was deleted. ABORTED (UPDATE_CONFLICT) if a model was
// made for a description that another update has replaced since: build it again. The errors of
// `rules.accept`. If the device has no room even to undo the
// change of a cloth, the cloth ends and is freed (step requests that name it end with
// RESOURCE_EXHAUSTED, DEVICE_MEMORY), and the message says so. Device thread.
Status UpdateOnDevice(Backend& backend, std::span<const std::shared_ptr<ClothRecord>> cloths,
                      const ClothChange& change, std::span<const ChangedModel> models,
                      const ModelRules& rules = {});

// BackendDescription::prepare for the first few of the cloths as they will be.
void PrepareUpdate(std::span<const std::shared_ptr<ClothRecord>> cloths, const ClothChange& change,
                   std::span<const ChangedModel> models,
                   const std::function<void(const SceneModel&, const ClothParameters&)>& prepare);

// The reason of the error of an update that came too late.
inline constexpr char kUpdateConflict[] = "UPDATE_CONFLICT";

}  // namespace drape
