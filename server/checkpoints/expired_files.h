// Cloths of sessions whose lease has run out, on disk for `drape restore`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "server/core/status.h"

namespace drape {

// A hash of the session's name, which is a secret: files are called by it.
std::string FileStemOf(const std::string& session_name);

// A folder of snapshots. A tenant (all sessions without one are one) has at most kMaxFiles in it
// and `max_bytes`: its oldest files make room for a new one, and never those of others. One caller
// at a time.
class ExpiredFiles {
 public:
  static constexpr size_t kMaxFiles = 64;
  using Writer = std::function<Status(const std::filesystem::path&, std::string_view)>;

  // `write`: as WriteDurably, which tests replace.
  ExpiredFiles(std::filesystem::path folder, uint64_t max_bytes, Writer write);

  // Makes the folder, and removes what a process left that was killed while it wrote. FILE_FAILED.
  Status Open() const;
  // Writes the snapshot of a session, and returns its path. Where the disk is full, more of the
  // tenant's oldest files go, as many as the new one needs, and it is tried again.
  // RESOURCE_EXHAUSTED (EXPIRED_TOO_LARGE) for more than `max_bytes`, which removes nothing;
  // DISK_FULL, FILE_FAILED.
  Result<std::filesystem::path> Keep(const std::string& tenant, const std::string& session_name,
                                     std::string_view snapshot) const;

 private:
  const std::filesystem::path folder_;
  const uint64_t max_bytes_;
  const Writer write_;
};

}  // namespace drape
