#include "server/checkpoints/durable_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <vector>

namespace drape {
namespace {

constexpr mode_t kOwnerOnly = 0600;
constexpr char kDraft[] = ".draft";
constexpr size_t kReadBytes = 1 << 20;

Status Failed(const std::string& what, const std::filesystem::path& path) {
  const bool is_full = errno == ENOSPC || errno == EDQUOT;
  return {StatusCode::kFailedPrecondition, is_full ? "DISK_FULL" : "FILE_FAILED",
          "cannot " + what + " " + path.string() + ": " + std::strerror(errno)};
}

// Closes at the end of its life.
class OpenFile {
 public:
  OpenFile(const std::filesystem::path& path, int flags)
      : descriptor_(open(path.c_str(), flags | O_CLOEXEC, kOwnerOnly)) {}
  ~OpenFile() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  bool is_open() const { return descriptor_ >= 0; }
  bool Write(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t written = write(descriptor_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return false;
      bytes.remove_prefix(static_cast<size_t>(written));
    }
    return true;
  }
  bool Sync() const { return fsync(descriptor_) == 0; }
  // To the end.
  bool Read(std::string& bytes) const {
    std::vector<char> part(kReadBytes);
    while (true) {
      const ssize_t count = read(descriptor_, part.data(), part.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return count == 0;
      bytes.append(part.data(), static_cast<size_t>(count));
    }
  }

 private:
  const int descriptor_;
};

Status WriteDraft(const std::filesystem::path& draft, std::string_view bytes) {
  const OpenFile file(draft, O_WRONLY | O_CREAT | O_TRUNC);
  if (!file.is_open() || !file.Write(bytes) || !file.Sync()) return Failed("write", draft);
  return Status::Ok();
}

}  // namespace

Status WriteDurably(const std::filesystem::path& path, std::string_view bytes) {
  const std::filesystem::path draft = path.string() + kDraft;
  Status status = WriteDraft(draft, bytes);
  if (status.ok() && rename(draft.c_str(), path.c_str()) != 0) status = Failed("rename", draft);
  if (!status.ok()) {
    unlink(draft.c_str());
    return status;
  }
  const OpenFile folder(path.parent_path(), O_RDONLY | O_DIRECTORY);
  if (!folder.is_open() || !folder.Sync()) return Failed("write", path.parent_path());
  return Status::Ok();
}

Result<std::string> ReadWhole(const std::filesystem::path& path) {
  const OpenFile file(path, O_RDONLY);
  std::string bytes;
  if (!file.is_open() || !file.Read(bytes)) return Failed("read", path);
  return bytes;
}

void RemoveDrafts(const std::filesystem::path& folder) {
  std::error_code ignored;
  std::vector<std::filesystem::path> drafts;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    if (entry.path().extension() == kDraft) drafts.push_back(entry.path());
  }
  for (const auto& draft : drafts) std::filesystem::remove(draft, ignored);
}

FolderLock::~FolderLock() {
  if (file_ >= 0) close(file_);
}

Status FolderLock::Take(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / "lock";
  file_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kOwnerOnly);
  if (file_ < 0) return Failed("open", path);
  if (flock(file_, LOCK_EX | LOCK_NB) == 0) return Status::Ok();
  if (errno != EWOULDBLOCK) return Failed("lock", path);
  return {StatusCode::kFailedPrecondition, "FOLDER_IN_USE",
          "another server writes its checkpoints to " + folder.string()};
}

}  // namespace drape
