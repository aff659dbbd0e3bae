#include "client/cli/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <limits>
#include <system_error>

#include "drape/error.h"

namespace drape::cli {
namespace {

template <class Number>
void AppendGeneral(Number value, int digits, std::string* text) {
  char buffer[64];
  const auto result =
      std::to_chars(buffer, buffer + sizeof(buffer), value, std::chars_format::general, digits);
  text->append(buffer, result.ptr);
}

namespace fs = std::filesystem;

// Devices, pipes and the like have no older content to keep and cannot be replaced.
bool IsSpecial(const fs::path& path) {
  for (const char* open_files : {"/dev/std", "/dev/fd/", "/proc/"}) {
    if (path.string().starts_with(open_files)) return true;
  }
  std::error_code ignored;
  return fs::exists(path, ignored) && !fs::is_regular_file(path, ignored);
}

// The target of a symbolic link, so that the link stays a link.
fs::path Target(const fs::path& path) {
  std::error_code error;
  fs::path target = fs::canonical(path, error);
  return error ? path : target;
}

}  // namespace

void ThrowCannotWrite(const std::filesystem::path& path) {
  ErrorDetails details;
  details.code = ErrorCode::kUnavailable;
  details.reason = "CANNOT_WRITE";
  details.message = "cannot write " + path.string() + ": " + std::strerror(errno);
  throw Error(std::move(details));
}

OutputFile::OutputFile(const std::filesystem::path& path)
    : path_(path), target_(path), written_(path) {
  if (!IsSpecial(path)) {
    target_ = Target(path);
    if (access(target_.c_str(), W_OK) != 0 && errno != ENOENT) ThrowCannotWrite(path_);
    written_ = target_.string() + "." + std::to_string(getpid()) + ".part";
  }
  file_ = std::fopen(written_.c_str(), "wbe");
  if (file_ == nullptr) ThrowCannotWrite(path_);
}

OutputFile::~OutputFile() {
  if (file_ == nullptr) return;
  std::fclose(file_);
  Discard();
}

void OutputFile::Write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) ThrowCannotWrite(path_);
}

void OutputFile::WriteAtStart(std::string_view bytes) {
  if (std::fseek(file_, 0, SEEK_SET) != 0) ThrowCannotWrite(path_);
  Write(bytes);
  if (std::fseek(file_, 0, SEEK_END) != 0) ThrowCannotWrite(path_);
}

void OutputFile::Close() {
  std::FILE* file = file_;
  file_ = nullptr;
  const bool has_failed = std::ferror(file) != 0;
  const bool is_written = std::fclose(file) == 0 && !has_failed;
  if (is_written && (written_ == target_ || std::rename(written_.c_str(), target_.c_str()) == 0)) {
    return;
  }
  const int error = errno;
  Discard();
  errno = error;
  ThrowCannotWrite(path_);
}

void OutputFile::Discard() {
  std::error_code ignored;
  if (written_ != target_) fs::remove(written_, ignored);
}

FilePointer OpenSpool(const fs::path& path) {
  if (!IsSpecial(path)) {
    fs::path folder = Target(path).parent_path();
    if (folder.empty()) folder = ".";
    const int descriptor = open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (descriptor >= 0) {
      if (std::FILE* file = fdopen(descriptor, "w+b")) return FilePointer(file);
      close(descriptor);
    }
  }
  // A folder without a disk, or a file system without unnamed files.
  FilePointer file(std::tmpfile());
  if (file == nullptr) ThrowCannotWrite("a temporary file for " + path.string());
  return file;
}

void AppendNumber(float value, std::string* text) {
  AppendGeneral(value, std::numeric_limits<float>::max_digits10, text);
}
void AppendNumber(double value, std::string* text) {
  AppendNumber(value, std::numeric_limits<double>::max_digits10, text);
}
void AppendNumber(double value, int digits, std::string* text) {
  AppendGeneral(value, digits, text);
}
void AppendNumber(uint64_t value, std::string* text) {
  *text += std::to_string(value);
}

}  // namespace drape::cli
