#include "server/session/page_token.h"

#include <gtest/gtest.h>

namespace drape {
namespace {

TEST(PageToken, SizesAreClamped) {
  EXPECT_EQ(EffectivePageSize(0), kDefaultPageSize);
  EXPECT_EQ(EffectivePageSize(7), 7u);
  EXPECT_EQ(EffectivePageSize(kMaxPageSize + 1), kMaxPageSize);
}

TEST(PageToken, WhatIsMadeIsRead) {
  for (const uint64_t number : {uint64_t{1}, uint64_t{42}, ~uint64_t{0}}) {
    EXPECT_EQ(ParsePageToken(MakePageToken(number)).value(), number);
  }
  EXPECT_EQ(ParsePageToken("").value(), 0u);
}

TEST(PageToken, AnythingElseIsRefused) {
  for (const char* token : {"7", "after-", "after--1", "after-1x", "after-01", "after- 1",
                            "after-18446744073709551616", "before-1"}) {
    const auto parsed = ParsePageToken(token);
    ASSERT_FALSE(parsed.ok()) << token;
    EXPECT_EQ(parsed.status().violations()[0].field, "page_token");
  }
}

}  // namespace
}  // namespace drape
