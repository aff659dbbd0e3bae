#include "server/core/session_permits.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace drape {
namespace {

TEST(SessionPermits, APermitIsTakenUntilItsLastHolderIsGone) {
  SessionPermits permits("FULL", {"max_per_session", 1}, PermitLimit{"max", 10}, 50);
  std::shared_ptr<void> permit = permits.Take("a").value();
  std::shared_ptr<void> copy = permit;
  EXPECT_TRUE(permits.Take("b").ok());
  permit.reset();
  const Status refusal = permits.Take("a").status();
  EXPECT_EQ(refusal.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(refusal.reason(), "FULL");
  EXPECT_EQ(refusal.message(), "the limit is reached: max_per_session is 1");
  EXPECT_EQ(refusal.retry_after_ms(), 50);
  copy.reset();
  EXPECT_TRUE(permits.Take("a").ok());
}

TEST(SessionPermits, AllTogetherAreLimitedToo) {
  SessionPermits permits("FULL", {"max_per_session", 2}, PermitLimit{"max", 3}, std::nullopt);
  const auto a = permits.Take("a").value();
  const auto b = permits.Take("b").value();
  auto c = permits.Take("c").value();
  const Status refusal = permits.Take("d").status();
  EXPECT_EQ(refusal.message(), "the limit is reached: max is 3");
  EXPECT_EQ(refusal.retry_after_ms(), std::nullopt);
  c.reset();
  EXPECT_TRUE(permits.Take("d").ok());
}

TEST(SessionPermits, AnEmptySessionIsCountedInAllAlone) {
  SessionPermits permits("FULL", {"max_per_session", 1}, PermitLimit{"max", 2}, std::nullopt);
  const auto first = permits.Take("").value();
  const auto second = permits.Take("").value();
  EXPECT_FALSE(permits.Take("").ok());
}

TEST(SessionPermits, APermitMayOutliveThem) {
  std::optional<SessionPermits> permits;
  permits.emplace("FULL", PermitLimit{"max_per_session", 1}, PermitLimit{"max", 1}, std::nullopt);
  auto permit = permits->Take("a").value();
  const std::weak_ptr<void> watch = permit;
  permits.reset();
  EXPECT_FALSE(watch.expired()) << "a permit belongs to its taker";
  permit.reset();
  EXPECT_TRUE(watch.expired());
}

TEST(SessionPermits, AnOwnerHasAtMostWhatItLeavesFree) {
  SessionPermits permits("TOO_MANY", {"each", 10}, PermitLimit{"all", 4}, std::nullopt);
  const auto first = permits.Take("a", "greedy"), second = permits.Take("b", "greedy");
  const Status third = permits.Take("c", "greedy").status();
  EXPECT_EQ(third.reason(), "TOO_MANY");
  EXPECT_EQ(third.message(), "the limit is reached: what one owner leaves free of all is 2");
  auto other = permits.Take("d", "modest");
  EXPECT_TRUE(other.ok());
  EXPECT_FALSE(permits.Take("e", "modest").ok()) << "the last is for whoever comes next";
  EXPECT_TRUE(permits.Take("f").ok()) << "a session without a tenant is an owner";
}

TEST(SessionPermits, TwoTenantsDoNotTakeAll) {
  SessionPermits permits("TOO_MANY", {"each", 100}, PermitLimit{"all", 32}, std::nullopt);
  std::vector<std::shared_ptr<void>> held;
  for (const char* const tenant : {"a", "b"}) {
    for (auto permit = permits.Take("s", tenant); permit.ok(); permit = permits.Take("s", tenant)) {
      held.push_back(std::move(permit).value());
    }
  }
  EXPECT_EQ(held.size(), 16u + 8u);
  EXPECT_TRUE(permits.Take("t", "c").ok());
  held.clear();
  EXPECT_TRUE(permits.Take("s", "a").ok());
}

}  // namespace
}  // namespace drape
