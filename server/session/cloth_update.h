// Changing cloths that run: all of them or none.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/session/cloth_record.h"
#include "server/session/model_cache.h"
#include "server/solver/backend.h"

namespace drape {

// What a cloth is built from after its pins were replaced.
struct RepinnedModel {
  std::shared_ptr<const ModelDescription> description;
  std::shared_ptr<const SceneModel> model;
};

// The models of the cloths with other pins, [cloth_count]; cloths of one description share one. The
// pins' particles are checked ("spec.pins[2].particle"). Any thread.
Result<std::vector<RepinnedModel>> BuildRepinnedModels(
    std::span<const std::shared_ptr<ClothRecord>> cloths, const std::vector<Pin>& pins,
    ModelCache& models);

// Applies the change to all the cloths or to none. `repinned` is empty unless change.pins is set,
// then [cloth_count]. NOT_FOUND if one of them has been deleted. If the device has no room even for
// taking the change back, the cloths that it has none for end and are freed (they are no longer
// alive then, and step requests that name them end with RESOURCE_EXHAUSTED, DEVICE_MEMORY); the
// message says so. Device thread.
Status UpdateOnDevice(Backend& backend, std::span<const std::shared_ptr<ClothRecord>> cloths,
                      const ClothChange& change, std::span<const RepinnedModel> repinned);

}  // namespace drape
