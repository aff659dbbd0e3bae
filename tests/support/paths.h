// Where tests find the source tree and the programs. Header only: the two definitions are per
// test executable (drape_test in tests/CMakeLists.txt).
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace drape::test {

// DRAPE_TEST_ROOT, if set, stands for both: a folder with the files that are read at run time in
// their places and the programs in bin/. For tests that were carried to another machine.
inline std::filesystem::path SourcePath(const std::string& relative) {
  const char* root = std::getenv("DRAPE_TEST_ROOT");
  return std::filesystem::path(root == nullptr ? DRAPE_SOURCE_DIR : root) / relative;
}

inline std::filesystem::path ProgramPath(const std::string& name) {
  const char* root = std::getenv("DRAPE_TEST_ROOT");
  const std::filesystem::path bin =
      root == nullptr ? std::filesystem::path(DRAPE_BIN_DIR) : std::filesystem::path(root) / "bin";
  return bin / name;
}

}  // namespace drape::test
