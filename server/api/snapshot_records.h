// The bytes of a snapshot: records of messages (proto/drape/v1/snapshot_file.proto).
#pragma once

#include <google/protobuf/message_lite.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "server/core/status.h"

namespace drape::api {

// SNAPSHOT_DAMAGED.
Status SnapshotDamaged(const std::string& why);

class SnapshotWriter {
 public:
  SnapshotWriter();
  // INTERNAL for a message of 2 GiB or more.
  Status Add(const google::protobuf::MessageLite& message);
  std::string Take() { return std::move(bytes_); }

 private:
  std::string bytes_;
  uint64_t records_ = 0;
};

// Reads bytes that must outlive it.
class SnapshotReader {
 public:
  explicit SnapshotReader(std::string_view bytes) : rest_(bytes) {}
  // SNAPSHOT_DAMAGED unless the bytes begin as a snapshot does.
  Status Begin();
  // The next record. SNAPSHOT_DAMAGED when it is cut off, differs from what was written, or is no
  // such message.
  Status Read(google::protobuf::MessageLite& message);
  // What has not been read.
  std::string_view rest() const { return rest_; }
  // SNAPSHOT_DAMAGED unless every byte has been read.
  Status End() const;

 private:
  std::string_view rest_;
  uint64_t records_ = 0;
};

}  // namespace drape::api
