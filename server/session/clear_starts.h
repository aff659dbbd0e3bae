// Where the copies of a creation start that are described caught in their colliders.
#pragma once

#include <cstdint>
#include <functional>

#include "server/session/cloth_record.h"

namespace drape {

inline constexpr uint32_t kMaxCaughtStarts = 64;  // of one request

// Sets ClothCopy::start of the copies that need one. Copies that lie alike among the same colliders
// share it, and it is looked for once; RESOURCE_EXHAUSTED where more than kMaxCaughtStarts are
// looked for, since builders are there for all tenants. `stop_reason` is asked before each search;
// what it says is returned. Milliseconds to seconds per copy that is caught. Any thread but the
// device's.
Status FindClearStarts(ClothCreation& creation, const std::function<Status()>& stop_reason);

}  // namespace drape
