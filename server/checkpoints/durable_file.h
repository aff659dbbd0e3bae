// Files that are there whole, or as they were before.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "server/core/status.h"

namespace drape {

// Writes beside `path`, to the disk, then takes its place there; only the owner may read it. After
// an error (DISK_FULL, FILE_FAILED) an older file is as it was. Blocks.
Status WriteDurably(const std::filesystem::path& path, std::string_view bytes);

// FILE_FAILED.
Result<std::string> ReadWhole(const std::filesystem::path& path);

// What a process that was killed has left of files that it wrote to the folder.
void RemoveDrafts(const std::filesystem::path& folder);

// A lock that ends with the process, however that ends.
class FolderLock {
 public:
  FolderLock() = default;
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  // FOLDER_IN_USE by another process, FILE_FAILED.
  Status Take(const std::filesystem::path& folder);

 private:
  int file_ = -1;
};

}  // namespace drape
