// The wire contract as committed text, so that every change of it is deliberate.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/proto/descriptors.h"
#include "tests/support/paths/paths.h"

namespace drape::test {
namespace {

const std::filesystem::path kGoldenPath = SourcePath("tests/golden/drape_v1.txt");

// Everything on the wire: names, numbers and types, without comments.
std::string ContractText() {
  const Descriptors descriptors;
  std::string text;
  for (const auto* file : descriptors.Files()) {
    text += "// " + file->name() + "\n" + file->DebugString() + "\n";
  }
  return text;
}

TEST(GoldenDescriptors, AreWhatIsCommitted) {
  const std::string text = ContractText();
  if (std::getenv("DRAPE_RENEW_GOLDEN") != nullptr) std::ofstream(kGoldenPath) << text;
  std::ifstream file(kGoldenPath);
  const std::string golden{std::istreambuf_iterator<char>(file), {}};
  EXPECT_EQ(text, golden) << "The protocol differs from " << kGoldenPath
                          << ".\nIf this is intended: add a line to "
                          << "proto/CHANGELOG.md, then run\n  DRAPE_RENEW_GOLDEN=1 proto_test "
                          << "--gtest_filter='GoldenDescriptors.*'\nand commit the file.";
}

}  // namespace
}  // namespace drape::test
