// Cloths start again: at rest where they were created, or elsewhere, with other parameters.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/core/ids.h"
#include "server/core/status.h"
#include "server/scene/description.h"
#include "server/session/cloth_record.h"
#include "server/solver/backend.h"

namespace drape {

// How each of several cloths starts again; both [cloth_count] or empty.
struct ClothStarts {
  std::vector<RigidTransform> transforms;    // empty: where they were created
  std::vector<ParameterOverride> overrides;  // from now on; empty: parameters stay

  // Null: where it was created.
  const RigidTransform* TransformOf(size_t index) const {
    return transforms.empty() ? nullptr : &transforms[index];
  }
};

// The cloths that the ids name among those of a request. INVALID_ARGUMENT ("<path>.cloth_ids[r]")
// names one that is not, or that occurs twice.
Result<std::vector<std::shared_ptr<ClothRecord>>> FindAmong(
    std::span<const ClothId> ids, std::span<const std::shared_ptr<ClothRecord>> cloths,
    const char* path);

// What changes besides the states; there are overrides.
ClothChange OverridesOf(const ClothStarts& starts);
// Changes the parameters of all the cloths or of none, then starts all of them again. NOT_FOUND if
// one of them was deleted. Device thread.
Status ResetOnDevice(Backend& backend, std::span<const std::shared_ptr<ClothRecord>> cloths,
                     const ClothStarts& starts);

// NOT_FOUND if one was deleted. Device thread.
Status CheckAlive(std::span<const std::shared_ptr<ClothRecord>> cloths);
// Replaces the states, [cloth_count] in the frames of the cloths, of those that are not deleted.
// Device thread.
Status WriteOnDevice(Backend& backend, std::span<const std::shared_ptr<ClothRecord>> cloths,
                     std::span<const ParticleState> states);

}  // namespace drape
