// From saved cloths to the bytes of a snapshot. Pure.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/core/status.h"
#include "server/session/saved_states.h"
#include "server/solver/backend.h"

namespace drape::api {

// The same bytes every time. `version` is that of the server. `count`, if there is one, is told of
// all the bytes that there will be with the next record, before they are; an error of it ends this.
Result<std::string> WriteSnapshot(const SavedStates& saved, const BackendDescription& backend,
                                  const std::string& version,
                                  const std::function<Status(uint64_t bytes)>& count = {});

}  // namespace drape::api
