#include "server/core/memory_size.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/support/page_faults.h"

namespace drape {
namespace {

namespace fs = std::filesystem;

class ControlGroups : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "drape_groups_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    root_ = pattern;
  }
  void TearDown() override { fs::remove_all(root_); }
  void Write(const std::string& file, const std::string& text) const {
    fs::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text << "\n";
  }
  fs::path root_;
};

TEST_F(ControlGroups, TheLeastLimitAlongThePathCounts) {
  EXPECT_EQ(ControlGroupMemory_bytes("0::/a/b\n", root_), UINT64_MAX);
  Write("a/b/memory.max", "max");
  Write("a/memory.max", "1000");
  Write("c/memory.max", "1");
  EXPECT_EQ(ControlGroupMemory_bytes("0::/a/b\n", root_), 1000u);
  Write("a/b/memory.max", "500");
  EXPECT_EQ(ControlGroupMemory_bytes("0::/a/b\n", root_), 500u);
}

// In a container the path is that of the host, and the limit is at the root.
TEST_F(ControlGroups, TheRootCounts) {
  Write("memory.max", "700");
  EXPECT_EQ(ControlGroupMemory_bytes("0::/\n", root_), 700u);
  EXPECT_EQ(ControlGroupMemory_bytes("0::/elsewhere/x\n", root_), 700u);
}

TEST_F(ControlGroups, BothVersions) {
  Write("memory/x/memory.limit_in_bytes", "900");
  EXPECT_EQ(ControlGroupMemory_bytes("9:cpu,memory:/x\n0::/\n", root_), 900u);
  EXPECT_EQ(ControlGroupMemory_bytes("9:cpu:/x\n", root_), UINT64_MAX);
  EXPECT_EQ(ControlGroupMemory_bytes("nonsense\n:\n", root_), UINT64_MAX);
}

TEST(MemoryOfProcess, LimitsOfTheProcessCount) {
  if (!test::kHasGlibcHeap) GTEST_SKIP() << "a sanitizer needs addresses without limits";
  const uint64_t before = MemoryOfProcess_bytes();
  EXPECT_GT(before, uint64_t{1} << 20);
  rlimit former{};
  ASSERT_EQ(getrlimit(RLIMIT_DATA, &former), 0);
  rlimit lower = former;
  lower.rlim_cur = before / 2;
  ASSERT_EQ(setrlimit(RLIMIT_DATA, &lower), 0);
  EXPECT_EQ(MemoryOfProcess_bytes(), before / 2);
  ASSERT_EQ(setrlimit(RLIMIT_DATA, &former), 0);
}

}  // namespace
}  // namespace drape
