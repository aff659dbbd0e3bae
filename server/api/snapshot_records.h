// The bytes of a snapshot: records of messages (proto/drape/v1/snapshot_file.proto).
#pragma once

#include <google/protobuf/message.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <string_view>

#include "server/core/status.h"

namespace drape::api {

// SNAPSHOT_DAMAGED.
Status SnapshotDamaged(const std::string& why);

class SnapshotWriter {
 public:
  // `count`: of WriteSnapshot.
  explicit SnapshotWriter(std::function<Status(uint64_t bytes)> count = {});
  // RESOURCE_EXHAUSTED (SNAPSHOT_TOO_LARGE) for a message of 2 GiB or more; the error of `count`.
  Status Add(const google::protobuf::MessageLite& message);
  std::string Take() { return std::move(bytes_); }

 private:
  const std::function<Status(uint64_t bytes)> count_;
  std::string bytes_;
  uint64_t records_ = 0;
};

// Reads bytes that must outlive it.
class SnapshotReader {
 public:
  // `most_parsed_bytes`: what a record may take in memory, once parsed, beside twice its bytes. The
  // numbers of a state take no more than those; all else came in requests.
  explicit SnapshotReader(std::string_view bytes,
                          uint64_t most_parsed_bytes = std::numeric_limits<uint64_t>::max())
      : rest_(bytes), most_parsed_bytes_(most_parsed_bytes) {}
  // SNAPSHOT_DAMAGED unless the bytes begin as a snapshot does.
  Status Begin();
  // The next record. SNAPSHOT_DAMAGED when it is cut off, differs from what was written, or is no
  // such message; RESOURCE_EXHAUSTED (REQUEST_TOO_LARGE) before it is parsed.
  Status Read(google::protobuf::Message& message);
  // What has not been read.
  std::string_view rest() const { return rest_; }
  // SNAPSHOT_DAMAGED unless every byte has been read.
  Status End() const;

 private:
  std::string_view rest_;
  const uint64_t most_parsed_bytes_;
  uint64_t records_ = 0;
};

}  // namespace drape::api
