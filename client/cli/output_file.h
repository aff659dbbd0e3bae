// A file that is written, with errors that name it.
#pragma once

#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

namespace drape::cli {

// Buffered text output. Throws drape::Error (reason "CANNOT_WRITE") from every function.
class OutputFile {
 public:
  explicit OutputFile(const std::filesystem::path& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void Write(std::string_view text);
  // Nothing may be written afterwards. Without it, the destructor removes the unfinished file.
  void Close();

 private:
  std::filesystem::path path_;
  std::FILE* file_;
};

// Appends the shortest %g form with 9 significant digits.
void AppendNumber(float value, std::string* text);
// With 17.
void AppendNumber(double value, std::string* text);
void AppendNumber(uint64_t value, std::string* text);

// Throws the error of a file that cannot be written; errno tells why.
[[noreturn]] void ThrowCannotWrite(const std::filesystem::path& path);

}  // namespace drape::cli
