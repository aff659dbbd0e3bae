#include "client/cli/output_file.h"

#include <cerrno>
#include <charconv>
#include <cstring>
#include <limits>
#include <system_error>

#include "drape/error.h"

namespace drape::cli {
namespace {

template <class Number>
void AppendGeneral(Number value, std::string* text) {
  char buffer[64];
  const auto result =
      std::to_chars(buffer, buffer + sizeof(buffer), value, std::chars_format::general,
                    std::numeric_limits<Number>::max_digits10);
  text->append(buffer, result.ptr);
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
    : path_(path), file_(std::fopen(path.c_str(), "wbe")) {
  if (file_ == nullptr) ThrowCannotWrite(path_);
}

OutputFile::~OutputFile() {
  if (file_ == nullptr) return;
  std::fclose(file_);
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path_, ignored)) std::filesystem::remove(path_, ignored);
}

void OutputFile::Write(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), file_) != text.size()) ThrowCannotWrite(path_);
}

void OutputFile::Close() {
  std::FILE* file = file_;
  file_ = nullptr;
  if (std::fclose(file) != 0) ThrowCannotWrite(path_);
}

void AppendNumber(float value, std::string* text) {
  AppendGeneral(value, text);
}
void AppendNumber(double value, std::string* text) {
  AppendGeneral(value, text);
}
void AppendNumber(uint64_t value, std::string* text) {
  *text += std::to_string(value);
}

}  // namespace drape::cli
