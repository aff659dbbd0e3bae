// Changing cloths that run: all of them or none.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/session/cloth_record.h"
#include "server/session/model_change.h"
#include "server/solver/backend.h"

namespace drape {

// Applies the change to all the cloths or to none. `models` is empty unless change.needs_model(),
// then [cloth_count]. NOT_FOUND if one of them has been deleted. If the device has no room even for
// taking the change back, the cloths that it has none for end and are freed (they are no longer
// alive then, and step requests that name them end with RESOURCE_EXHAUSTED, DEVICE_MEMORY); the
// message says so. Device thread.
Status UpdateOnDevice(Backend& backend, std::span<const std::shared_ptr<ClothRecord>> cloths,
                      const ClothChange& change, std::span<const ChangedModel> models);

}  // namespace drape
