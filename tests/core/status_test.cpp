#include "server/core/status.h"

#include <gtest/gtest.h>

#include <memory>
#include <set>

namespace drape {
namespace {

TEST(Status, DefaultIsSuccess) {
  EXPECT_TRUE(Status().ok());
  EXPECT_TRUE(Status::Ok().ok());
  EXPECT_EQ(Status().ToString(), "OK");
}

TEST(Status, InvalidFieldsListsThemAll) {
  const Status status =
      Status::InvalidFields({{"grid.rows", "0 is not >= 1"}, {"pins", "too many"}});
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(status.reason(), "INVALID_FIELDS");
  ASSERT_EQ(status.violations().size(), 2u);
  EXPECT_EQ(status.violations()[1].field, "pins");
  EXPECT_EQ(status.message(), "grid.rows: 0 is not >= 1; pins: too many");
  EXPECT_EQ(status.ToString(),
            "INVALID_ARGUMENT (INVALID_FIELDS): grid.rows: 0 is not >= 1; pins: too many");
}

TEST(Status, RetryIsSetOnlyOnRequest) {
  Status status(StatusCode::kResourceExhausted, "QUEUE_FULL", "full");
  EXPECT_FALSE(status.retry_after_ms());
  status.RetryAfterMs(250);
  EXPECT_EQ(status.retry_after_ms(), 250);
}

TEST(Status, EveryCodeHasItsOwnName) {
  std::set<std::string_view> names;
  for (int code = 0; code <= static_cast<int>(StatusCode::kInternal); ++code) {
    names.insert(StatusCodeName(static_cast<StatusCode>(code)));
  }
  EXPECT_EQ(names.size(), static_cast<size_t>(StatusCode::kInternal) + 1);
  EXPECT_EQ(names.count("UNKNOWN"), 0u);
}

TEST(Result, HoldsAValueOrAStatus) {
  const Result<int> good = 7;
  EXPECT_TRUE(good.ok());
  EXPECT_EQ(*good, 7);
  EXPECT_TRUE(good.status().ok());
  const Result<int> bad = Status::InvalidField("x", "is bad");
  EXPECT_FALSE(bad.ok());
  EXPECT_EQ(bad.status().violations().size(), 1u);
}

TEST(Result, MovesWhatCannotBeCopied) {
  Result<std::unique_ptr<int>> result = std::make_unique<int>(3);
  const std::unique_ptr<int> taken = std::move(result).value();
  EXPECT_EQ(*taken, 3);
}

TEST(ResultDeathTest, ValueOfAFailureIsAProgrammerError) {
  const Result<int> bad = Status::InvalidField("x", "is bad");
  EXPECT_DEATH(static_cast<void>(bad.value()), "value\\(\\) of a failed Result");
  EXPECT_DEATH(static_cast<void>(Result<int>(Status::Ok())), "needs an error");
}

TEST(ReturnIfError, PassesFailuresOnAndGoesOnOtherwise) {
  const auto run = [](const Status& first) -> Status {
    DRAPE_RETURN_IF_ERROR(first);
    return {StatusCode::kAborted, "REACHED", "the end"};
  };
  EXPECT_EQ(run(Status::Ok()).reason(), "REACHED");
  EXPECT_EQ(run(Status::InvalidField("x", "bad")).reason(), "INVALID_FIELDS");
}

}  // namespace
}  // namespace drape
