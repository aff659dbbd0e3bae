#include "server/session/reaper.h"

#include <gtest/gtest.h>

#include <thread>

#include "tests/session/session_fixture.h"

namespace drape {
namespace {

class ReaperTest : public SessionFixture {};

TEST_F(ReaperTest, EndsExpiredSessionsWithoutBeingAsked) {
  Start();
  ASSERT_TRUE(CreateOne() != nullptr);
  lease_ = {};
  const Reaper reaper(*registry_, std::chrono::milliseconds(1));
  EXPECT_EQ(registry_->Totals().session_count, 1u);
  clock_.AdvanceUs(static_cast<int64_t>(kDefaultTtl_s * 1e6));
  while (registry_->Totals().session_count > 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  while (device_->live_cloths() > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

}  // namespace
}  // namespace drape
