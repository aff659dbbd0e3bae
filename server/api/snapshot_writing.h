// From saved cloths to the bytes of a snapshot. Pure.
#pragma once

#include <string>

#include "server/core/status.h"
#include "server/session/saved_states.h"
#include "server/solver/backend.h"

namespace drape::api {

// The same bytes every time. `version` is that of the server.
Result<std::string> WriteSnapshot(const SavedStates& saved, const BackendDescription& backend,
                                  const std::string& version);

}  // namespace drape::api
