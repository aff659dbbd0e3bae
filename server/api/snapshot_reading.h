// From the bytes of a snapshot to cloths that can be made: everything is checked as if a stranger
// had written it.
#pragma once

#include <string_view>
#include <vector>

#include "server/api/limits.h"
#include "server/core/interruption.h"
#include "server/core/status.h"
#include "server/session/saved_states.h"
#include "server/session/session.h"
#include "server/solver/backend.h"

namespace drape::api {

// For whom a snapshot is read.
struct SnapshotTarget {
  const BackendDescription& backend;
  const RequestLimits& limits;
  Interruption* interruption;  // asked now and then; null: nobody is
  Session& session;
  bool is_inexact = false;  // another build, backend or device is accepted
};

// Seconds of work: builder threads. The ids are the former ones; plans are open. Models, maps
// and colliders count for the session as soon as they are read. INVALID_ARGUMENT (SNAPSHOT_DAMAGED;
// INVALID_FIELDS: "cloths[2].runtime.pins[0]"), FAILED_PRECONDITION (SNAPSHOT_TOO_NEW,
// OTHER_BUILD), RESOURCE_EXHAUSTED (QUOTA_EXCEEDED, REQUEST_TOO_LARGE).
Result<std::vector<SavedCloth>> ReadSnapshot(std::string_view bytes, const SnapshotTarget& target);

}  // namespace drape::api
