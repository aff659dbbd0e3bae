// Start positions for the copies of a creation that would start inside their colliders.
#pragma once

#include <cstdint>

#include "server/core/interruption.h"
#include "server/session/cloth_record.h"

namespace drape {

inline constexpr uint32_t kMaxCaughtStarts = 64;  // per request

// Sets ClothCopy::start of the copies that need one. Copies with the same position relative to the
// same colliders share one search. RESOURCE_EXHAUSTED if more than kMaxCaughtStarts searches are
// needed, because all sessions share the builder threads. `interruption`: asked before each search
// and between the sweeps of one; null: nobody is. A search takes milliseconds to seconds. Not on
// the device thread.
Status FindClearStarts(ClothCreation& creation, Interruption* interruption = nullptr);

}  // namespace drape
