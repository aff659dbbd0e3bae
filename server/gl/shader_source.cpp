#include "server/gl/shader_source.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>

namespace drape::gl {

namespace {

constexpr std::array<std::string_view, 5> kExtensions = {".h", ".glsl", ".comp", ".vert", ".frag"};

Status CompileError(const std::string& message) {
  return Status(StatusCode::kInternal, "SHADER_COMPILE_FAILED", message);
}

// The rest of a line after `#include`; none for other lines.
std::optional<std::string_view> IncludeOperand(std::string_view line) {
  const auto skip_blanks = [&line] {
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
  };
  constexpr std::string_view kWord = "include";
  skip_blanks();
  if (!line.starts_with('#')) return std::nullopt;
  line.remove_prefix(1);
  skip_blanks();
  if (!line.starts_with(kWord)) return std::nullopt;
  line.remove_prefix(kWord.size());
  skip_blanks();
  return line;
}

// The file of the operand `"file"`; empty for `<file>`, which only C++ reads. Interface headers are
// included as "shaders/interface/x.h", as C++ needs it.
std::string IncludedFile(std::string_view operand) {
  constexpr std::string_view kPrefix = "shaders/";
  if (!operand.starts_with('"')) return "";
  operand.remove_prefix(1);
  operand = operand.substr(0, operand.find('"'));
  if (operand.starts_with(kPrefix)) operand.remove_prefix(kPrefix.size());
  return std::string(operand);
}

// A position in a driver log: 0:line(column) or 0(line).
struct LogPlace {
  size_t line = 0;
  size_t length = 0;  // characters of the position; 0: there is none
};

LogPlace ParsePlace(std::string_view text) {
  const auto digits = [&text](size_t from) {
    size_t end = from;
    while (end < text.size() && std::isdigit(static_cast<unsigned char>(text[end])) != 0) ++end;
    return end - from;
  };
  if (!text.starts_with("0:") && !text.starts_with("0(")) return {};
  const size_t line_digits = digits(2);
  constexpr size_t kMostDigits = 9;
  if (line_digits == 0 || line_digits > kMostDigits) return {};
  const size_t line = std::stoul(std::string(text.substr(2, line_digits)));
  size_t end = 2 + line_digits;
  if (text[1] == ':') {
    if (end >= text.size() || text[end] != '(') return {};
    end += 1 + digits(end + 1);
  }
  if (end >= text.size() || text[end] != ')') return {};
  return {line, end + 1};
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
      if (const std::optional<std::string_view> operand = IncludeOperand(line)) {
        const std::string file = IncludedFile(*operand);
        if (file.empty()) continue;
        DRAPE_RETURN_IF_ERROR(AppendFile(file, name + ":" + std::to_string(number)));
      } else {
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
  std::string replaced;
  bool is_at_word_start = true;
  while (!log.empty()) {
    const LogPlace place = is_at_word_start ? ParsePlace(log) : LogPlace{};
    if (place.length > 0 && place.line >= 1 && place.line <= lines.size()) {
      const SourceLine& line = lines[place.line - 1];
      replaced += line.file + ":" + std::to_string(line.line);
      log.remove_prefix(place.length);
    } else {
      replaced += log.front();
      is_at_word_start = std::isspace(static_cast<unsigned char>(log.front())) != 0;
      log.remove_prefix(1);
    }
  }
  return replaced;
}

Status ShaderLibrary::AddDirectory(const std::string& directory) {
  std::error_code error;
  std::filesystem::recursive_directory_iterator entries(directory, error);
  if (error) {
    return Status(StatusCode::kNotFound, "SHADER_DIR_NOT_FOUND",
                  "shader directory \"" + directory + "\": " + error.message());
  }
  std::map<std::string, std::string> found;
  for (const auto& entry : entries) {
    const std::string extension = entry.path().extension().string();
    if (std::find(kExtensions.begin(), kExtensions.end(), extension) == kExtensions.end()) continue;
    std::ifstream file(entry.path());
    std::ostringstream text;
    text << file.rdbuf();
    found[entry.path().lexically_relative(directory).generic_string()] = text.str();
  }
  const bool is_any_replaced = std::any_of(found.begin(), found.end(), [this](const auto& entry) {
    return files_.contains(entry.first);
  });
  if (!is_any_replaced && !files_.empty()) {
    return Status(StatusCode::kNotFound, "SHADER_DIR_UNUSED",
                  "shader directory \"" + directory +
                      "\" holds no file that replaces one, such as " + files_.begin()->first);
  }
  for (auto& [path, text] : found) Add(path, std::move(text));
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
