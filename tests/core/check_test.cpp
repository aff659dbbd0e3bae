#include "server/core/check.h"

#include <gtest/gtest.h>

namespace {

TEST(CheckDeathTest, AbortsWithPlaceConditionAndMessage) {
  const int two = 2;
  DRAPE_CHECK(two == 2, "never seen");
  EXPECT_DEATH(DRAPE_CHECK(two == 3, "two is not three"),
               "check_test.cpp:[0-9]+: check failed: two == 3: two is not three");
}

TEST(CheckDeathTest, IsOneStatementUnderAnIf) {
  bool is_reached = false;
  if (is_reached)
    DRAPE_CHECK(false, "must not run");
  else
    is_reached = true;
  EXPECT_TRUE(is_reached);
}

}  // namespace
