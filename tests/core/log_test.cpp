#include "server/core/log.h"

#include <gtest/gtest.h>

namespace drape {
namespace {

// One case: the logger is set up once per process.
TEST(InitLog, RefusesUnknownLevelsAndWritesStructuredLines) {
  const Status status = InitLog("loud");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.violations().front().field, "log-level");
  EXPECT_NE(status.message().find("'loud'"), std::string::npos);

  ::testing::internal::CaptureStderr();
  ASSERT_TRUE(InitLog("info").ok());
  spdlog::info("cloth_created id={} particles={}", 5, 1024);
  spdlog::debug("not_seen");
  const std::string lines = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(lines.find("info cloth_created id=5 particles=1024\n"), std::string::npos) << lines;
  EXPECT_EQ(lines.find("not_seen"), std::string::npos);
  EXPECT_EQ(lines.find("20"), 0u) << "a line begins with the date: " << lines;
}

}  // namespace
}  // namespace drape
