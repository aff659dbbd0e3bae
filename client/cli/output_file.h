// A file that is written, with errors that name it.
#pragma once

#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

namespace drape::cli {

// Buffered text output. Throws drape::Error (reason "CANNOT_WRITE") from every function. Goes to a
// file beside the one that is named (PATH.PID.part), which Close() puts in its place: an older file
// stays until then. What is no regular file, such as /dev/null, is written directly.
class OutputFile {
 public:
  explicit OutputFile(const std::filesystem::path& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void Write(std::string_view text);
  // Nothing may be written afterwards. Without it, the destructor removes what was written.
  void Close();

 private:
  void Discard();

  std::filesystem::path path_;     // as named
  std::filesystem::path target_;   // where links lead
  std::filesystem::path written_;  // the target, or the file that will replace it
  std::FILE* file_ = nullptr;
};

// Appends the shortest %g form with 9 significant digits.
void AppendNumber(float value, std::string* text);
// With 17.
void AppendNumber(double value, std::string* text);
void AppendNumber(double value, int digits, std::string* text);
void AppendNumber(uint64_t value, std::string* text);

// Throws the error of a file that cannot be written; errno tells why.
[[noreturn]] void ThrowCannotWrite(const std::filesystem::path& path);

}  // namespace drape::cli
