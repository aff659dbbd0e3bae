// A file being written, with errors that name it.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace drape::cli {

// Buffered output. Every function throws drape::Error (reason "CANNOT_WRITE"). Writes to a file
// beside the named one (PATH.PID.part), which Close() puts in its place: an older file stays until
// then. A file that is not regular, such as /dev/null, is written directly.
class OutputFile {
 public:
  explicit OutputFile(const std::filesystem::path& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void Write(std::string_view bytes);
  // Overwrites the beginning of the file, which has been written already, or writes it first. For
  // headers that count the rest.
  void WriteAtStart(std::string_view bytes);
  // Nothing may be written afterwards. Without it, the destructor removes the file.
  void Close();

 private:
  void Discard();

  std::filesystem::path path_;     // as named
  std::filesystem::path target_;   // where links lead
  std::filesystem::path written_;  // the target, or the file that will replace it
  std::FILE* file_ = nullptr;
};

struct FileCloser {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using FilePointer = std::unique_ptr<std::FILE, FileCloser>;

// An unnamed temporary file, to read and write, removed when it is closed. On the disk of `path`,
// which needs room for both. Throws as OutputFile does.
FilePointer OpenSpool(const std::filesystem::path& path);

// Appends the shortest %g form with 9 significant digits.
void AppendNumber(float value, std::string* text);
// With 17.
void AppendNumber(double value, std::string* text);
void AppendNumber(double value, int digits, std::string* text);
void AppendNumber(uint64_t value, std::string* text);

// Throws the error of a file that cannot be written; errno has the reason.
[[noreturn]] void ThrowCannotWrite(const std::filesystem::path& path);

}  // namespace drape::cli
