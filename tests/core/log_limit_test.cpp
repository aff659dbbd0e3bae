#include "server/core/log_limit.h"

#include <gtest/gtest.h>

namespace drape {
namespace {

TEST(LogLimit, SomeOfASecondPassAndTheRestIsCounted) {
  LogLimit limit(2);
  EXPECT_TRUE(limit.Ask(0).is_admitted);
  EXPECT_TRUE(limit.Ask(999'999).is_admitted);
  for (int k = 0; k < 5; ++k) EXPECT_FALSE(limit.Ask(999'999).is_admitted);
  const LogLimit::Verdict next = limit.Ask(1'000'000);
  EXPECT_TRUE(next.is_admitted);
  EXPECT_EQ(next.left_out, 5u);
  EXPECT_EQ(limit.Ask(1'000'001).left_out, 0u);
}

}  // namespace
}  // namespace drape
