#include "tests/support/paths/paths.h"

#include <cstdlib>

namespace drape::test {

std::filesystem::path SourcePath(const std::string& relative) {
  const char* root = std::getenv("DRAPE_TEST_ROOT");
  return std::filesystem::path(root == nullptr ? DRAPE_SOURCE_DIR : root) / relative;
}

std::filesystem::path ProgramPath(const std::string& name) {
  const char* root = std::getenv("DRAPE_TEST_ROOT");
  const std::filesystem::path bin =
      root == nullptr ? std::filesystem::path(DRAPE_BIN_DIR) : std::filesystem::path(root) / "bin";
  return bin / name;
}

std::filesystem::path BuildPath(const std::string& relative) {
  return std::filesystem::path(DRAPE_BUILD_DIR) / relative;
}

std::string CompilerCommand() {
  return DRAPE_COMPILER;
}

}  // namespace drape::test
