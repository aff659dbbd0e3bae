// Turns shader files into the text that a driver compiles, and positions in the driver's log back
// into files and lines.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/core/status.h"

namespace drape::gl {

// The origin of a line of a shader's text; lines count from 1.
struct SourceLine {
  std::string file;
  int line = 0;
};

// A complete shader. Its text has no #line directives, because Mesa drops their source-string
// number in many messages; `lines` has the same information.
struct ShaderSource {
  std::string name;  // "kernels/measure_pieces.comp"
  std::string text;
  std::vector<SourceLine> lines;  // the origin of each line of `text`
};

// Replaces the positions in driver logs, "0:line(column)" (Mesa) and "0(line)" (NVIDIA), by
// "file:line".
std::string WithFileNames(std::string_view log, const std::vector<SourceLine>& lines);

// A set of shader files by path. Copyable; thread-safe when constant.
class ShaderLibrary {
 public:
  // Paths are relative to the shader directory, with '/'.
  void Add(std::string path, std::string text) { files_[std::move(path)] = std::move(text); }

  // Adds every .h, .glsl, .comp, .vert and .frag file below `directory`, or replaces the present
  // one. NOT_FOUND: SHADER_DIR_NOT_FOUND if the directory cannot be read, SHADER_DIR_UNUSED if no
  // file replaces one.
  Status AddDirectory(const std::string& directory);

  // The file `path` with `defines` ("#define X 1\n...") before it and every `#include "file"`
  // resolved, each file once. INTERNAL (SHADER_COMPILE_FAILED) names file and line of a missing
  // include.
  Result<ShaderSource> Assemble(const std::string& path, std::string_view defines) const;

 private:
  std::map<std::string, std::string> files_;
};

}  // namespace drape::gl
