// Page tokens of lists in order of creation.
#pragma once

#include <cstdint>
#include <string>

#include "server/core/status.h"
#include "server/session/session_limits.h"

namespace drape {

// 0 means the default; values above the maximum mean the maximum.
uint32_t EffectivePageSize(uint32_t page_size);
// `last_creation_number`: that of the last item shown.
std::string MakePageToken(uint64_t last_creation_number);
// 0 for the empty token (the first page). INVALID_ARGUMENT "page_token" for anything that
// MakePageToken does not make.
Result<uint64_t> ParsePageToken(const std::string& token);

}  // namespace drape
