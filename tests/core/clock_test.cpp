#include "server/core/clock.h"

#include <gtest/gtest.h>

namespace drape {
namespace {

TEST(FakeClock, MovesOnlyWhenTurned) {
  FakeClock clock;
  const int64_t start_us = clock.NowUs();
  EXPECT_EQ(clock.NowUs(), start_us);
  clock.AdvanceUs(1500);
  EXPECT_EQ(clock.NowUs(), start_us + 1500);
}

TEST(SteadyClock, NeverGoesBackAndCountsMicroseconds) {
  const SteadyClock clock;
  const int64_t start_us = clock.NowUs();
  const auto start = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - start < std::chrono::milliseconds(2)) {
  }
  EXPECT_GE(clock.NowUs() - start_us, 2000);
}

}  // namespace
}  // namespace drape
