#include "server/checkpoints/expired_files.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "server/api/sha256.h"
#include "server/checkpoints/durable_file.h"
#include "server/core/text.h"

namespace drape {
namespace {

namespace fs = std::filesystem;

constexpr size_t kHashDigits = 32, kTenantDigits = 8;

struct File {
  fs::path path;
  fs::file_time_type written;
  uint64_t bytes = 0;
};

// Of one tenant, the newest first.
std::vector<File> FilesOf(const fs::path& folder, const std::string& prefix) {
  std::vector<File> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (!entry.path().filename().string().starts_with(prefix)) continue;
    if (entry.path().extension() != ".snapshot") continue;
    const uintmax_t bytes = entry.file_size(error);
    if (error) continue;  // an operator has taken it away
    files.push_back({entry.path(), entry.last_write_time(error), bytes});
  }
  std::ranges::sort(files, std::greater(), &File::written);
  return files;
}

uint64_t BytesOf(const std::vector<File>& files) {
  uint64_t bytes = 0;
  for (const File& file : files) bytes += file.bytes;
  return bytes;
}

void RemoveOldest(std::vector<File>& files) {
  std::error_code ignored;
  fs::remove(files.back().path, ignored);
  files.pop_back();
}

}  // namespace

std::string FileStemOf(const std::string& session_name) {
  return HexOf(api::Sha256Of(session_name)).substr(0, kHashDigits);
}

ExpiredFiles::ExpiredFiles(fs::path folder, uint64_t max_bytes, Writer write)
    : folder_(std::move(folder)), max_bytes_(max_bytes), write_(std::move(write)) {}

Status ExpiredFiles::Open() const {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) {
    return {StatusCode::kFailedPrecondition, "FILE_FAILED",
            "cannot make the folder " + folder_.string() + ": " + error.message()};
  }
  RemoveDrafts(folder_);
  return Status::Ok();
}

Result<fs::path> ExpiredFiles::Keep(const std::string& tenant, const std::string& session_name,
                                    std::string_view snapshot) const {
  if (snapshot.size() > max_bytes_) {
    return Status(StatusCode::kResourceExhausted, "EXPIRED_TOO_LARGE",
                  "the snapshot has " + std::to_string(snapshot.size()) + " bytes, and a tenant " +
                      "may have " + std::to_string(max_bytes_));
  }
  const std::string prefix = HexOf(api::Sha256Of(tenant)).substr(0, kTenantDigits) + "-";
  const fs::path path = folder_ / (prefix + FileStemOf(session_name) + ".snapshot");
  std::vector<File> others = FilesOf(folder_, prefix);
  std::erase_if(others, [&](const File& file) { return file.path == path; });
  while (others.size() >= kMaxFiles || BytesOf(others) > max_bytes_ - snapshot.size()) {
    RemoveOldest(others);
  }
  Status status = write_(path, snapshot);
  if (status.reason() == "DISK_FULL" && !others.empty()) {
    const uint64_t before = BytesOf(others);
    while (!others.empty() && before - BytesOf(others) < snapshot.size()) RemoveOldest(others);
    status = write_(path, snapshot);
  }
  if (!status.ok()) return status;
  return path;
}

}  // namespace drape
