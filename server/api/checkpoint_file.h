// The bytes of the file to which a session is written: its record, then a snapshot of its cloths.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "server/core/status.h"
#include "server/session/saved_states.h"
#include "server/session/session_registry.h"
#include "server/solver/backend.h"

namespace drape::api {

// By whom and when a checkpoint was written.
struct CheckpointStamp {
  std::string incarnation;
  double written_unix_s = 0;
  uint32_t start = 0;  // of the servers of the folder; 0: unknown
};

struct CheckpointBytes {
  std::string bytes;
  std::string digest;  // of everything but the stamp
};

Result<CheckpointBytes> WriteCheckpoint(const FormerSession& session, const SavedStates& saved,
                                        const BackendDescription& backend,
                                        const std::string& version, const CheckpointStamp& stamp);

struct CheckpointHead {
  FormerSession session;
  CheckpointStamp stamp;
  std::string_view snapshot;  // for ReadSnapshot; part of the bytes that were read
};

// SNAPSHOT_DAMAGED, SNAPSHOT_TOO_NEW.
Result<CheckpointHead> ReadCheckpointHead(std::string_view bytes);

}  // namespace drape::api
