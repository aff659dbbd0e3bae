// The rules of the tree that no compiler checks: allowed includes, folders of foreign headers,
// sizes, a README per folder, and places of shader code. server/README.md and shaders/README.md
// state them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/lint/tree.h"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using ::testing::IsEmpty;

std::vector<std::string> Includes(const std::string& text) {
  static const std::regex kInclude(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])", std::regex::multiline);
  std::vector<std::string> includes;
  for (std::sregex_iterator it(text.begin(), text.end(), kInclude), end; it != end; ++it) {
    includes.push_back((*it)[1]);
  }
  return includes;
}

bool StartsWith(const std::string& text, const std::string& prefix) {
  return text.compare(0, prefix.size(), prefix) == 0;
}

// A file's folder among the keys of the rule table: the longest that is a prefix of its path.
template <class Rules>
typename Rules::const_iterator RuleFor(const Rules& rules, const std::string& file) {
  auto best = rules.end();
  for (auto it = rules.begin(); it != rules.end(); ++it) {
    if (StartsWith(file, it->first + "/") &&
        (best == rules.end() || it->first.size() > best->first.size())) {
      best = it;
    }
  }
  return best;
}

// Folder -> folders of ours that it may include from, besides itself. A folder does not open its
// subfolders: server/solver does not include server/solver/cpu.
const std::map<std::string, std::set<std::string>> kMayInclude = {
    {"server/core", {}},
    {"server/scene", {"server/core"}},
    {"server/solver", {"server/core", "server/scene"}},
    {"server/solver/self_contact",
     {"server/core", "server/scene", "server/solver", "shaders/interface"}},
    {"server/solver/bodies", {"server/core", "server/scene", "server/solver"}},
    {"server/solver/surface_contact",
     {"server/core", "server/scene", "server/solver", "server/solver/self_contact"}},
    {"server/solver/cpu_reference",
     {"server/core", "server/scene", "server/solver", "server/solver/bodies",
      "server/solver/self_contact", "server/solver/surface_contact"}},
    {"server/solver/cpu/simd", {}},
    {"server/solver/cpu/formulas", {"server/scene", "server/solver", "server/solver/cpu/simd"}},
    {"server/solver/cpu/model",
     {"server/core", "server/scene", "server/solver", "server/solver/bodies",
      "server/solver/cpu/simd", "server/solver/cpu/formulas"}},
    {"server/solver/cpu/step",
     {"server/core", "server/scene", "server/solver", "server/solver/bodies",
      "server/solver/self_contact", "server/solver/cpu/simd", "server/solver/cpu/formulas",
      "server/solver/cpu/model"}},
    {"server/solver/cpu/alone",
     {"server/solver", "server/solver/bodies", "server/solver/self_contact",
      "server/solver/surface_contact", "server/solver/cpu/simd", "server/solver/cpu/formulas",
      "server/solver/cpu/model", "server/solver/cpu/step"}},
    {"server/solver/cpu/side_by_side",
     {"server/solver", "server/solver/cpu/simd", "server/solver/cpu/formulas",
      "server/solver/cpu/model", "server/solver/cpu/step"}},
    {"server/solver/cpu",
     {"server/core", "server/scene", "server/solver", "server/solver/cpu/simd",
      "server/solver/cpu/model", "server/solver/cpu/step", "server/solver/cpu/alone",
      "server/solver/cpu/side_by_side", "server/solver/self_contact",
      "server/solver/surface_contact"}},
    {"server/gl", {"server/core"}},
    {"server/solver/gl_compute",
     {"server/core", "server/scene", "server/solver", "server/solver/self_contact", "server/gl",
      "shaders", "shaders/interface"}},
    {"server/render", {"server/core", "server/scene", "server/solver"}},
    {"server/render/gl_draw",
     {"server/core", "server/scene", "server/solver", "server/gl", "server/render", "shaders",
      "shaders/interface"}},
    {"server/scheduler", {"server/core", "server/scene", "server/solver"}},
    {"server/operations", {"server/core"}},
    {"server/session", {"server/core", "server/scene", "server/solver", "server/scheduler"}},
    {"server/api",
     {"server/core", "server/scene", "server/solver", "server/render", "server/scheduler",
      "server/session"}},
    {"server/checkpoints",
     {"server/core", "server/scene", "server/solver", "server/scheduler", "server/session",
      "server/api"}},
    {"client",
     {"client/include/drape", "client/src", "client/src/scenes", "client/cli", "client/examples"}},
};

// Foreign headers and the only folders (and files) that may name them.
struct ForeignRule {
  std::regex header;
  std::set<std::string> folders;
};
const std::vector<ForeignRule> kForeign = {
    {std::regex("^(grpc|grpcpp|google/(protobuf|rpc)|drape/v1)/.*"),
     {"server/api", "client", "server/main.cpp", "server/config_file.cpp"}},
    {std::regex("^(EGL|epoxy)/.*"),
     {"server/gl", "server/solver/gl_compute", "server/render/gl_draw"}},
    {std::regex("^(tbb|oneapi|hwy)/.*"), {"server/solver/cpu"}},
    {std::regex("^tiny_obj_loader.h|^zip.h"), {"client"}},
    {std::regex("^png.h"), {"server/render"}},
    {std::regex("^(Bullet|btBullet|LinearMath/).*"), {}},  // the benchmark's peer: tests/bench only
};

TEST(LintTest, FoldersIncludeOnlyWhatTheDiagramAllows) {
  std::vector<std::string> violations;
  int checked = 0;
  for (const char* top : {"server", "client"}) {
    for (const fs::path& file : FilesBelow(top, {".h", ".cpp"})) {
      const auto rule = RuleFor(kMayInclude, file.string());
      if (rule == kMayInclude.end()) continue;  // main.cpp and config: the place that wires all
      ++checked;
      for (const std::string& include : Includes(ReadFile(kRoot / file))) {
        if (!StartsWith(include, "server/") && !StartsWith(include, "client/") &&
            !StartsWith(include, "shaders/") && !StartsWith(include, "tests/")) {
          continue;
        }
        const std::string folder = fs::path(include).parent_path().string();
        if (folder != rule->first && !rule->second.contains(folder)) {
          violations.push_back(file.string() + " includes " + include);
        }
      }
    }
  }
  EXPECT_GT(checked, 30) << "the test no longer finds the sources";
  EXPECT_THAT(violations, IsEmpty());
}

TEST(LintTest, OnlyTheServersTopLevelWiresConcreteParts) {
  for (const fs::path& file : FilesBelow("server", {".h", ".cpp"})) {
    if (file.parent_path() != "server") continue;
    EXPECT_THAT(
        file.filename().string(),
        ::testing::AnyOf("main.cpp", "config.h", "config.cpp", "config_file.h", "config_file.cpp",
                         "backend_choice.h", "backend_choice.cpp", "restart.h", "restart.cpp",
                         "signals.h", "signals.cpp", "wiring.h", "wiring.cpp"));
  }
}

TEST(LintTest, ForeignHeadersStayInTheirFolders) {
  std::vector<std::string> violations;
  for (const char* top : {"server", "client"}) {
    for (const fs::path& file : FilesBelow(top, {".h", ".cpp"})) {
      for (const std::string& include : Includes(ReadFile(kRoot / file))) {
        for (const ForeignRule& rule : kForeign) {
          if (!std::regex_match(include, rule.header)) continue;
          const bool is_allowed =
              std::any_of(rule.folders.begin(), rule.folders.end(), [&](const std::string& folder) {
                return file == folder || StartsWith(file.string(), folder + "/");
              });
          if (!is_allowed) violations.push_back(file.string() + " includes " + include);
        }
      }
    }
  }
  EXPECT_THAT(violations, IsEmpty());
}

TEST(LintTest, ShaderLibraryHasNoBuffersAndKernelsHaveAMain) {
  static const std::regex kBuffer(R"(\b(buffer|shared|layout)\b\s*[\(\w])");
  static const std::regex kMain(R"(void\s+main\s*\()");
  for (const fs::path& file : FilesBelow("shaders/lib", {".glsl"})) {
    const std::string text =
        std::regex_replace(ReadFile(kRoot / file), std::regex("//[^\n]*"), std::string());
    EXPECT_FALSE(std::regex_search(text, kBuffer)) << file << " declares storage";
    EXPECT_FALSE(std::regex_search(text, kMain)) << file << " has an entry point";
  }
  const std::vector<fs::path> kernels = FilesBelow("shaders/kernels", {".comp"});
  EXPECT_FALSE(kernels.empty());
  for (const fs::path& file : kernels) {
    EXPECT_TRUE(std::regex_search(ReadFile(kRoot / file), kMain)) << file << " has no entry point";
  }
}

TEST(LintTest, FilesStayReadable) {
  constexpr int kMaxLines = 500;
  for (const char* top : {"server", "client", "shaders", "tests"}) {
    for (const fs::path& file :
         FilesBelow(top, {".h", ".cpp", ".comp", ".glsl", ".cmake", ".proto"})) {
      const std::string text = ReadFile(kRoot / file);
      EXPECT_LE(std::count(text.begin(), text.end(), '\n'), kMaxLines) << file;
      std::istringstream lines(text);
      int number = 0;
      for (std::string line; std::getline(lines, line);) {
        ++number;
        EXPECT_LE(line.size(), 130u) << file << ":" << number;  // bytes: β and Λ count double
      }
    }
  }
  const std::string main_text = ReadFile(kRoot / "server/main.cpp");
  EXPECT_LE(std::count(main_text.begin(), main_text.end(), '\n'), 150);
}

TEST(LintTest, EverySourceFolderHasAReadme) {
  std::set<fs::path> folders;
  for (const char* top : {"server", "client", "shaders", "tests", "proto"}) {
    for (const fs::path& file :
         FilesBelow(top, {".h", ".cpp", ".comp", ".glsl", ".json", ".proto"})) {
      folders.insert(file.parent_path());
    }
  }
  for (const fs::path& folder : folders) {
    // A parent's README covers its leaves of one kind: shaders/{interface,lib,kernels}, proto/**,
    // ...
    bool is_covered = false;
    for (fs::path up = folder; up.has_relative_path() && !is_covered; up = up.parent_path()) {
      is_covered = fs::exists(kRoot / up / "README.md");
      if (StartsWith(up.string(), "server/") && up.parent_path() == "server") break;
    }
    EXPECT_TRUE(is_covered) << folder << " has no README.md";
  }
}

TEST(LintTest, EveryFolderOfTheTopReadmeExists) {
  const std::string readme = ReadFile(kRoot / "README.md");
  for (const char* folder : {"proto", "server", "client", "shaders", "tests", "docker"}) {
    EXPECT_TRUE(fs::is_directory(kRoot / folder)) << folder;
    EXPECT_NE(readme.find(std::string("`") + folder + "/`"), std::string::npos)
        << "README.md does not tell what " << folder << "/ is for";
  }
  for (const char* command : {"./run demo", "./run test"}) {
    EXPECT_NE(readme.find(command), std::string::npos) << command;
  }
}

// Two classes of one name in one namespace break the one-definition rule, which no linker reports.
TEST(LintTest, ClassNamesAreUniqueInTheServer) {
  static const std::regex kNamespace(R"(^namespace ([\w:]+) \{)", std::regex::multiline);
  static const std::regex kClass(R"(^(?:class|struct) (\w+)(?: final)?(?: :[^{;]*)? ?\{)",
                                 std::regex::multiline);
  std::map<std::string, fs::path> seen;
  for (const fs::path& file : FilesBelow("server", {".h"})) {
    const std::string text = ReadFile(kRoot / file);
    std::smatch space;
    ASSERT_TRUE(std::regex_search(text, space, kNamespace)) << file << " opens no namespace";
    for (std::sregex_iterator it(text.begin(), text.end(), kClass), end; it != end; ++it) {
      const std::string name = space[1].str() + "::" + (*it)[1].str();
      const auto [place, is_new] = seen.emplace(name, file);
      EXPECT_TRUE(is_new) << name << " in " << file << " and " << place->second;
    }
  }
  EXPECT_GT(seen.size(), 50u);
}

// No global mutable state of the simulation: sessions share the process.
TEST(LintTest, NoSingletons) {
  static const std::regex kSingleton(R"(\b(GetInstance|Singleton|getCurrent)\s*\()");
  for (const fs::path& file : FilesBelow("server", {".h", ".cpp"})) {
    EXPECT_FALSE(std::regex_search(ReadFile(kRoot / file), kSingleton)) << file;
  }
}

}  // namespace
}  // namespace drape::test
