#include "server/scheduler/session_index.h"

#include <gtest/gtest.h>

namespace drape {
namespace {

TEST(SessionIndex, NumbersOfThoseWhoLeftAreUsedAgain) {
  SessionIndex index;
  EXPECT_EQ(index.Enter("a"), 0u);
  EXPECT_EQ(index.Enter("b"), 1u);
  EXPECT_EQ(index.Enter("a"), 0u);
  index.Leave("a");
  EXPECT_EQ(index.Enter("c"), 2u);
  index.Leave("a");
  EXPECT_EQ(index.Enter("d"), 0u);
}

}  // namespace
}  // namespace drape
