// What the start of a step, or a slice of a command, costs beside the particles that it writes, in
// units of those: one is about 12 ns of the device thread, for which everybody waits.
#pragma once

#include <cstdint>

#include "server/session/cloth_record.h"

namespace drape {

// Limit on the costs of what starts again in one step: 0.2 to 0.4 s, beside the particles.
inline constexpr uint64_t kMaxRestartCost = uint64_t{1} << 24;
// Limit on the costs of the cloths whose colliders one request moves. Most of it is paid by the
// first request that moves one of a cloth.
inline constexpr uint64_t kMaxMovedCost = uint64_t{1} << 25;

// Of the colliders of a description, which are placed anew.
inline uint64_t PlacingCost(const ClothDescription& description) {
  return 32 * description.parameters.colliders.size();
}
// Of giving a cloth this description, or another scheme of solving, and the lengths that are
// driven, if any: so many.
inline uint64_t RewritingCost(const ClothDescription& description, uint32_t driven_lengths) {
  return 512 + 128 * description.parameters.colliders.size() + 2 * uint64_t{driven_lengths};
}

// Of a cloth that is made, saved or changed in a slice of such (ClothsPerSlice).
inline uint64_t SliceCost(const SceneModel& model, const ClothParameters& parameters,
                          uint32_t driven_lengths = 0) {
  return model.particle_count() + 128 * parameters.colliders.size() + 2 * uint64_t{driven_lengths};
}

}  // namespace drape
