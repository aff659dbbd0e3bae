#include "server/gl/shader_source.h"

#include <filesystem>
#include <fstream>
#include <optional>
#include <regex>
#include <set>
#include <sstream>

namespace drape::gl {

namespace {

Status CompileError(const std::string& message) {
  return Status(StatusCode::kInternal, "SHADER_COMPILE_FAILED", message);
}

// `file` of a line `#include "file"`. Interface headers say "shaders/interface/x.h", as C++ needs
// it.
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

  Status AppendFile(const std::string& path, const std::string& included_from) {
    if (!included_.insert(path).second) return Status::Ok();
    const auto file = files_.find(path);
    if (file == files_.end()) {
      return CompileError(included_from + ": no shader file \"" + path + "\"");
    }
    return AppendText(path, file->second);
  }

  Status AppendText(const std::string& name, const std::string& text) {
    std::istringstream lines(text);
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
      if (const std::optional<std::string> next = IncludedFile(line)) {
        DRAPE_RETURN_IF_ERROR(AppendFile(*next, name + ":" + std::to_string(number)));
      } else if (!IsSystemInclude(line)) {
        source_.text += line + "\n";
        source_.lines.push_back({name, number});
      }
    }
    return Status::Ok();
  }

 private:
  const std::map<std::string, std::string>& files_;
  ShaderSource& source_;
  std::set<std::string> included_;
};

}  // namespace

std::string WithFileNames(std::string_view log, const std::vector<SourceLine>& lines) {
  static const std::regex kPlace(R"re((^|\n|\s)0(?::(\d+)\(\d+\)|\((\d+)\)))re");
  std::string replaced;
  std::string rest(log);
  std::smatch match;
  while (std::regex_search(rest, match, kPlace)) {
    const size_t number = std::stoul(match[2].matched ? match[2].str() : match[3].str());
    replaced += match.prefix().str();
    if (number >= 1 && number <= lines.size()) {
      const SourceLine& line = lines[number - 1];
      replaced += match[1].str() + line.file + ":" + std::to_string(line.line);
    } else {
      replaced += match[0].str();
    }
    rest = match.suffix().str();
  }
  return replaced + rest;
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
  ShaderSource source{.name = path, .text = {}, .lines = {}};
  Assembler assembler(files_, source);
  DRAPE_RETURN_IF_ERROR(assembler.AppendText("<version>", "#version 450 core\n"));
  DRAPE_RETURN_IF_ERROR(assembler.AppendText("<defines>", std::string(defines)));
  DRAPE_RETURN_IF_ERROR(assembler.AppendFile(path, path));
  return source;
}

}  // namespace drape::gl
