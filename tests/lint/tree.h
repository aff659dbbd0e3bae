// The files of the source tree, for the rules about them.
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/paths/paths.h"

namespace drape::test {

inline const std::filesystem::path kRoot = SourcePath("");

inline std::string ReadFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

// Files below `folder` with one of these extensions (empty: with any), relative to the root, in a
// fixed order.
inline std::vector<std::filesystem::path> FilesBelow(const std::string& folder,
                                                     const std::set<std::string>& extensions) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(kRoot / folder)) {
    const bool is_asked_for =
        extensions.empty() || extensions.contains(entry.path().extension().string());
    if (entry.is_regular_file() && is_asked_for) {
      files.push_back(std::filesystem::relative(entry.path(), kRoot));
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace drape::test
