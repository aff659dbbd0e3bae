// From shader files to the one text that a driver compiles, and from the driver's log back to files.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/core/status.h"

namespace drape::gl {

// A complete compute shader. `files[s]` is the name of source-string number s in #line directives.
struct ShaderSource {
  std::string name;  // "kernels/measure.comp"
  std::string text;
  std::vector<std::string> files;
};

// Replaces the places that drivers write into logs, "s:line(column)" (Mesa) and "s(line)" (NVIDIA), by
// "<file>:line", where s is a source-string number.
std::string WithFileNames(std::string_view log, const std::vector<std::string>& files);

// A set of shader files by path. Copyable; thread-safe when constant.
class ShaderLibrary {
 public:
  // Paths are relative to the shader directory, with '/'.
  void Add(std::string path, std::string text) { files_[std::move(path)] = std::move(text); }

  // Every .h, .glsl and .comp file below `directory` replaces or joins what is there. NOT_FOUND
  // (SHADER_DIR_NOT_FOUND) if the directory cannot be read.
  Status AddDirectory(const std::string& directory);

  // The file `path` with `defines` ("#define X 1\n...") before it and every `#include "file"` resolved,
  // each file once. INTERNAL (SHADER_COMPILE_FAILED) naming file and line of an include that is missing.
  Result<ShaderSource> Assemble(const std::string& path, std::string_view defines) const;

 private:
  std::map<std::string, std::string> files_;
};

}  // namespace drape::gl
