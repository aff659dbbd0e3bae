#include "server/checkpoints/durable_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

namespace drape {
namespace {

constexpr mode_t kOwnerOnly = 0600;

Status Failed(const std::string& what, const std::filesystem::path& path) {
  return {StatusCode::kFailedPrecondition, "FILE_FAILED",
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
  const std::filesystem::path draft = path.string() + ".draft";
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
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  if (!file || !bytes) return Failed("read", path);
  return std::move(bytes).str();
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
