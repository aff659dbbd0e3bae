#include "server/gl/shader_source.h"

#include <filesystem>
#include <fstream>
#include <optional>
#include <regex>
#include <set>
#include <sstream>

namespace drape::gl {

namespace {

constexpr std::string_view kVersionLine = "#version 450 core\n";
constexpr std::string_view kDefinesName = "<defines>";

Status CompileError(const std::string& message) {
  return Status(StatusCode::kInternal, "SHADER_COMPILE_FAILED", message);
}

// `file` of a line `#include "file"`. Interface headers say "shaders/interface/x.h", as C++ needs it.
std::optional<std::string> IncludedFile(const std::string& line) {
  static const std::regex kInclude(R"re(^\s*#\s*include\s+"(?:shaders/)?([^"]+)".*$)re");
  std::smatch match;
  if (!std::regex_match(line, match, kInclude)) return std::nullopt;
  return match[1].str();
}

bool IsSystemInclude(const std::string& line) {
  static const std::regex kSystemInclude(R"re(^\s*#\s*include\s+<.*$)re");
  return std::regex_match(line, kSystemInclude);
}

class Assembler {
 public:
  Assembler(const std::map<std::string, std::string>& files, ShaderSource& source)
      : files_(files), source_(source) {}

  Status Append(const std::string& path, const std::string& included_from) {
    if (!included_.insert(path).second) return Status::Ok();
    const auto file = files_.find(path);
    if (file == files_.end()) {
      return CompileError(included_from + ": no shader file \"" + path + "\"");
    }
    const size_t number = source_.files.size();
    source_.files.push_back(path);
    AppendLineDirective(1, number);
    std::istringstream lines(file->second);
    std::string line;
    for (int line_number = 1; std::getline(lines, line); ++line_number) {
      if (const std::optional<std::string> next = IncludedFile(line)) {
        DRAPE_RETURN_IF_ERROR(Append(*next, path + ":" + std::to_string(line_number)));
        AppendLineDirective(line_number + 1, number);
      } else {
        source_.text += IsSystemInclude(line) ? "\n" : line + "\n";
      }
    }
    return Status::Ok();
  }

 private:
  void AppendLineDirective(int line, size_t file_number) {
    source_.text += "#line " + std::to_string(line) + " " + std::to_string(file_number) + "\n";
  }

  const std::map<std::string, std::string>& files_;
  ShaderSource& source_;
  std::set<std::string> included_;
};

}  // namespace

std::string WithFileNames(std::string_view log, const std::vector<std::string>& files) {
  static const std::regex kMesa(R"re((^|\n|\s)(\d+):(\d+)\(\d+\))re");
  static const std::regex kNvidia(R"re((^|\n)(\d+)\((\d+)\)()?)re");
  std::string text(log);
  for (const std::regex& place : {std::cref(kMesa), std::cref(kNvidia)}) {
    std::string replaced;
    std::smatch match;
    std::string rest = text;
    while (std::regex_search(rest, match, place)) {
      const size_t file = std::stoul(match[2].str());
      replaced += match.prefix().str();
      replaced += file < files.size() ? match[1].str() + files[file] + ":" + match[3].str()
                                      : match[0].str();
      rest = match.suffix().str();
    }
    text = replaced + rest;
  }
  return text;
}

Status ShaderLibrary::AddDirectory(const std::string& directory) {
  std::error_code error;
  std::filesystem::recursive_directory_iterator entries(directory, error);
  if (error) {
    return Status(StatusCode::kNotFound, "SHADER_DIR_NOT_FOUND",
                  "shader directory \"" + directory + "\": " + error.message());
  }
  for (const auto& entry : entries) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".h" && extension != ".glsl" && extension != ".comp") continue;
    std::ifstream file(entry.path());
    std::ostringstream text;
    text << file.rdbuf();
    Add(entry.path().lexically_relative(directory).generic_string(), text.str());
  }
  return Status::Ok();
}

Result<ShaderSource> ShaderLibrary::Assemble(const std::string& path,
                                             std::string_view defines) const {
  ShaderSource source{.name = path, .text = std::string(kVersionLine), .files = {}};
  source.files.push_back(std::string(kDefinesName));
  source.text += "#line 1 0\n" + std::string(defines);
  if (!defines.empty() && defines.back() != '\n') source.text += '\n';
  DRAPE_RETURN_IF_ERROR(Assembler(files_, source).Append(path, path));
  return source;
}

}  // namespace drape::gl
