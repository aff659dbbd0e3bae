// The rules of documents and comments: links lead somewhere, pages stay short, and the names in
// them exist.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <unordered_set>
#include <vector>

#include "tests/lint/tree.h"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using ::testing::IsEmpty;

const std::vector<std::string> kTops = {"server", "client", "shaders", "tests", "proto", "docker"};

// Names that documents and comments mention although our code does not have them.
const std::set<std::string> kForeignNames = {
    "ColorBrewer",              // origin of a colour map
    "DebugString",              // code after a string with two slashes
    "DejaVu",                   // font of the legends
    "EGL_BAD_MATCH",            // error of EGL drivers
    "GL_INVALID_OPERATION",     // error of OpenGL drivers
    "GitHub",                   // renders the documents
    "PascalCase",               // style of names
    "RdBu",                     // colour map of ColorBrewer
    "ServerReflectionRequest",  // message of gRPC, sent as bytes
    "TrueType",                 // format of the font
    "UPPER_CASE",               // style of names
    "WlfXRN",                   // part of an address
    "kConstant",                // style of names
    "minimal_stack",            // option of gRPC
    "snake_case",               // style of names
};

bool IsGenerated(const fs::path& file) {
  return file.string().find("/results/") != std::string::npos;
}

std::vector<fs::path> Documents() {
  std::vector<fs::path> documents = {"README.md"};
  for (const std::string& top : kTops) {
    for (const fs::path& file : FilesBelow(top, {".md"})) documents.push_back(file);
  }
  return documents;
}

std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

bool IsFence(const std::string& line) {
  const size_t begin = line.find_first_not_of(' ');
  return begin != std::string::npos && line.compare(begin, 3, "```") == 0;
}

// The lines outside code blocks.
std::vector<std::string> Prose(const std::string& text) {
  std::vector<std::string> prose;
  bool is_code = false;
  for (const std::string& line : Lines(text)) {
    if (IsFence(line)) {
      is_code = !is_code;
    } else if (!is_code) {
      prose.push_back(line);
    }
  }
  return prose;
}

// The anchor that GitHub gives a heading: lower case, spaces as hyphens, other punctuation dropped.
std::string Anchor(const std::string& heading) {
  std::string anchor;
  for (const char c : heading) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x80 || std::isalnum(byte) || c == '_' || c == '-') {
      anchor += static_cast<char>(std::tolower(byte));
    } else if (c == ' ') {
      anchor += '-';
    }
  }
  return anchor;
}

std::set<std::string> Anchors(const fs::path& document) {
  std::set<std::string> anchors;
  for (const std::string& line : Prose(ReadFile(document))) {
    const size_t level = line.find_first_not_of('#');
    if (level == 0 || level == std::string::npos || line[level] != ' ') continue;
    const std::string anchor = Anchor(line.substr(level + 1));
    std::string unique = anchor;
    for (int k = 1; !anchors.insert(unique).second; ++k) unique = anchor + "-" + std::to_string(k);
  }
  return anchors;
}

TEST(DocumentsTest, LinksAndAnchorsLeadSomewhere) {
  static const std::regex kLink(R"(\]\(([^)#\s]*)(?:#([^)]*))?\))");
  std::map<fs::path, std::set<std::string>> anchors;
  std::vector<std::string> dangling;
  for (const fs::path& document : Documents()) {
    for (const std::string& line : Prose(ReadFile(kRoot / document))) {
      for (std::sregex_iterator it(line.begin(), line.end(), kLink), end; it != end; ++it) {
        const std::string target = (*it)[1];
        const std::string anchor = (*it)[2];
        if (target.starts_with("http")) continue;
        const fs::path file =
            target.empty() ? kRoot / document : kRoot / document.parent_path() / target;
        bool is_good = fs::exists(file);
        if (is_good && !anchor.empty()) {
          const auto [known, is_new] = anchors.try_emplace(file);
          if (is_new) known->second = Anchors(file);
          is_good = known->second.contains(anchor);
        }
        if (!is_good) dangling.push_back(document.string() + " links to " + it->str());
      }
    }
  }
  EXPECT_THAT(dangling, IsEmpty());
}

// Characters of UTF-8 text.
size_t Columns(const std::string& line) {
  return std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80; });
}

TEST(DocumentsTest, PagesStayShort) {
  constexpr size_t kMaxColumns = 120;
  constexpr size_t kMaxLinesOfTopReadme = 140;
  constexpr size_t kMaxLinesOfReadme = 60;
  std::vector<std::string> long_ones;
  for (const fs::path& document : Documents()) {
    const std::vector<std::string> lines = Lines(ReadFile(kRoot / document));
    for (size_t k = 0; k < lines.size(); ++k) {
      const size_t begin = lines[k].find_first_not_of(' ');
      const bool is_table = begin != std::string::npos && lines[k][begin] == '|';
      if (is_table || Columns(lines[k]) <= kMaxColumns) continue;
      long_ones.push_back(document.string() + ":" + std::to_string(k + 1));
    }
    if (document.filename() != "README.md" || IsGenerated(document)) continue;
    const size_t most = document == "README.md" ? kMaxLinesOfTopReadme : kMaxLinesOfReadme;
    if (lines.size() > most) long_ones.push_back(document.string());
  }
  EXPECT_THAT(long_ones, IsEmpty()) << "no line over 120 columns but in tables; a README has "
                                       "purpose, map, invariants, how to add";
}

bool IsWordCharacter(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
}

std::vector<std::string> Words(const std::string& text) {
  std::vector<std::string> words;
  for (size_t begin = 0; begin < text.size();) {
    if (!IsWordCharacter(text[begin])) {
      ++begin;
      continue;
    }
    size_t end = begin;
    while (end < text.size() && IsWordCharacter(text[end])) ++end;
    words.push_back(text.substr(begin, end - begin));
    begin = end;
  }
  return words;
}

const std::set<std::string> kCommentedCode = {".h",    ".cpp",  ".glsl", ".comp",
                                              ".vert", ".frag", ".proto"};

// Every word of the code (comments do not count) and of the names of files, and all paths.
struct KnownNames {
  std::unordered_set<std::string> words;
  std::set<std::string> files;  // relative to the root

  bool HasFile(const fs::path& from, const std::string& name) const {
    if (fs::exists(kRoot / name) || fs::exists(kRoot / from.parent_path() / name)) return true;
    const std::string end = "/" + name;
    return std::any_of(files.begin(), files.end(),
                       [&](const std::string& file) { return file.ends_with(end); });
  }

  // Stages are snake_case in texts and PascalCase in the code.
  bool HasWord(const std::string& word) const {
    if (words.contains(word) || kForeignNames.contains(word)) return true;
    std::string pascal;
    bool is_start = true;
    for (const char c : word) {
      if (c != '_') pascal += is_start ? static_cast<char>(std::toupper(c)) : c;
      is_start = c == '_';
    }
    return words.contains(pascal);
  }
};

std::string WithoutComments(const std::string& code) {
  static const std::regex kComment("//[^\n]*");
  return std::regex_replace(code, kComment, "");
}

KnownNames FindKnownNames() {
  KnownNames known;
  const std::set<std::string> other_code = {".py", ".sh", ".json", ".yaml", ".txt", ".cmake", ""};
  for (const std::string& top : kTops) {
    for (const fs::path& file : FilesBelow(top, {})) {
      if (IsGenerated(file)) continue;
      known.files.insert(file.string());
      for (std::string& word : Words(file.string())) known.words.insert(std::move(word));
      const bool is_commented = kCommentedCode.contains(file.extension().string());
      if (!is_commented && !other_code.contains(file.extension().string())) continue;
      const std::string text = ReadFile(kRoot / file);
      for (std::string& word : Words(is_commented ? WithoutComments(text) : text)) {
        known.words.insert(std::move(word));
      }
    }
  }
  for (const char* file : {"run", "CMakeLists.txt", "CMakePresets.json"}) {
    for (std::string& word : Words(ReadFile(kRoot / file))) known.words.insert(std::move(word));
  }
  return known;
}

// Words that can only be names in code: kConstant, PascalCase with two humps, UPPER_CASE.
bool IsCodeName(const std::string& word) {
  static const std::regex kName(
      "k[A-Z][A-Za-z0-9_]+|[A-Z][a-z0-9]+([A-Z][a-z0-9]*)+|[A-Z]{2,}[0-9]*(_[A-Z0-9]+)+");
  return std::regex_match(word, kName);
}

bool IsSnakeName(const std::string& word) {
  static const std::regex kName("[a-z][a-z0-9]*(_[a-z0-9]+)+");
  return std::regex_match(word, kName);
}

std::vector<std::string> FileNames(const std::string& text) {
  static const std::regex kFile(
      R"([A-Za-z0-9_][A-Za-z0-9_./-]*\.(h|cpp|comp|glsl|vert|frag|md|proto|py|sh)\b)");
  std::vector<std::string> names;
  for (std::sregex_iterator it(text.begin(), text.end(), kFile), end; it != end; ++it) {
    const bool is_pattern =
        it->position() > 0 && (text[it->position() - 1] == '*' || text[it->position() - 1] == '-');
    if (!is_pattern) names.push_back(it->str());
  }
  return names;
}

TEST(DocumentsTest, NamesInDocumentsExist) {
  static const std::regex kCodeSpan("`([^`]+)`");
  const KnownNames known = FindKnownNames();
  std::vector<std::string> unknown;
  for (const fs::path& document : Documents()) {
    if (IsGenerated(document) || document.filename() == "CHANGELOG.md") continue;
    for (const std::string& line : Prose(ReadFile(kRoot / document))) {
      std::vector<std::string> words;
      for (const std::string& word : Words(line)) {
        if (word[0] == 'k' && IsCodeName(word)) words.push_back(word);
      }
      std::string spans;
      for (std::sregex_iterator it(line.begin(), line.end(), kCodeSpan), end; it != end; ++it) {
        spans += (*it)[1].str() + " ";
      }
      const std::vector<std::string> files = FileNames(spans);
      for (const std::string& word : Words(spans)) {
        if (IsCodeName(word) || IsSnakeName(word)) words.push_back(word);
      }
      for (const std::string& word : words) {
        if (!known.HasWord(word)) unknown.push_back(document.string() + ": " + word);
      }
      for (const std::string& name : files) {
        const bool is_example = name.starts_with("x.") || name.find("/x.") != std::string::npos;
        if (!is_example && !known.HasFile(document, name)) {
          unknown.push_back(document.string() + ": " + name);
        }
      }
    }
  }
  EXPECT_THAT(unknown, IsEmpty());
}

TEST(DocumentsTest, NamesInCommentsExist) {
  static const std::regex kComment("//([^\n]*)");
  const KnownNames known = FindKnownNames();
  std::vector<std::string> unknown;
  for (const std::string& top : kTops) {
    for (const fs::path& file : FilesBelow(top, kCommentedCode)) {
      if (file.string().starts_with("proto/google/")) continue;  // upstream files, unchanged
      const std::string text = ReadFile(kRoot / file);
      for (std::sregex_iterator it(text.begin(), text.end(), kComment), end; it != end; ++it) {
        const std::string comment = (*it)[1];
        for (const std::string& word : Words(comment)) {
          if (IsCodeName(word) && !known.HasWord(word)) {
            unknown.push_back(file.string() + ": " + word);
          }
        }
        for (const std::string& name : FileNames(comment)) {
          if (name.find("/x.") == std::string::npos && !known.HasFile(file, name)) {
            unknown.push_back(file.string() + ": " + name);
          }
        }
      }
    }
  }
  EXPECT_THAT(unknown, IsEmpty());
}

}  // namespace
}  // namespace drape::test
