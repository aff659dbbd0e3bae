#include "server/core/byte_budget.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace drape {
namespace {

ByteBudget Budget(uint64_t per_owner, uint64_t in_all) {
  return {"TOO_MUCH", {"per_owner", per_owner}, {"in_all", in_all}, 50};
}

TEST(ByteBudget, BytesCountUntilTheLastHolderIsGone) {
  ByteBudget budget = Budget(100, 1000);
  auto held = budget.Take("a", 60).value();
  auto copy = held;
  const Status status = budget.Take("a", 41).status();
  EXPECT_EQ(status.reason(), "TOO_MUCH");
  EXPECT_EQ(status.message(), "per_owner is 100: 60 bytes are held, 41 more wanted");
  EXPECT_TRUE(status.retry_after_ms().has_value());
  EXPECT_TRUE(budget.Take("a", 40).ok());
  held = nullptr;
  EXPECT_FALSE(budget.Take("a", 41).ok());
  copy = nullptr;
  EXPECT_EQ(budget.used_bytes(), 0u);
  EXPECT_TRUE(budget.Take("a", 100).ok());
}

TEST(ByteBudget, OwnersDoNotShareTheirLimits) {
  ByteBudget budget = Budget(100, 150);
  const auto a = budget.Take("a", 100);
  EXPECT_TRUE(budget.Take("b", 50).ok());
  const Status status = budget.Take("b", 51).status();
  EXPECT_EQ(status.message(), "in_all is 150: 100 bytes are held, 51 more wanted");
}

TEST(ByteBudget, WhoHoldsNothingMayTakeOneThingThatIsLarger) {
  ByteBudget budget = Budget(100, 1000);
  const auto large = budget.Take("a", 900);
  ASSERT_TRUE(large.ok());
  EXPECT_FALSE(budget.Take("a", 1).ok());
  EXPECT_TRUE(budget.Take("b", 100).ok());
  const Status never = budget.Take("c", 1001).status();
  EXPECT_EQ(never.reason(), "TOO_MUCH");
  EXPECT_FALSE(never.retry_after_ms().has_value()) << "waiting would not help";
}

TEST(ByteBudget, ButNoMoreThanIsAllowedAtOnce) {
  ByteBudget budget("TOO_MUCH", {"per_owner", 100}, {"in_all", 1000}, 5, 500);
  const Status refused = budget.Take("a", 501).status();
  EXPECT_EQ(refused.message(),
            "what one may take of in_all at once is 500: 0 bytes are held, 501 more wanted");
  EXPECT_FALSE(refused.retry_after_ms().has_value()) << "waiting would not help";
  const auto a = budget.Take("a", 500), b = budget.Take("b", 500);
  EXPECT_TRUE(a.ok());
  EXPECT_TRUE(b.ok()) << "others find room";
}

TEST(ByteBudget, WhoeverComesNextFindsRoom) {
  ByteBudget budget = Budget(1000, 1200);
  std::vector<std::shared_ptr<void>> held;
  const auto take_all = [&](const std::string& owner) {
    for (;;) {
      auto taken = budget.Take(owner, 1);
      if (!taken.ok()) return taken.status();
      held.push_back(std::move(taken).value());
    }
  };
  EXPECT_EQ(take_all("a").message(),
            "what one owner leaves free of in_all is 600: 600 bytes are held, 1 more wanted");
  (void)take_all("b");
  EXPECT_EQ(budget.used_bytes("b"), 300u);
  const Status third = take_all("c");
  EXPECT_EQ(budget.used_bytes("c"), 150u);
  EXPECT_TRUE(third.retry_after_ms().has_value());
  EXPECT_TRUE(budget.Take("d", 75).ok());
}

TEST(ByteBudget, PermitsOutliveTheBudget) {
  std::vector<std::shared_ptr<void>> held;
  {
    ByteBudget budget = Budget(100, 1000);
    held.push_back(budget.Take("a", 10).value());
    EXPECT_EQ(budget.Take("a", 0).value(), nullptr);
  }
  held.clear();
}

}  // namespace
}  // namespace drape
