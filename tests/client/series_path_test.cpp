#include "client/cli/series_path.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

namespace drape::cli {
namespace {

TEST(SeriesPathTest, PutsTheStepBeforeTheExtension) {
  EXPECT_EQ(SeriesPath("s.obj", 60), "s_000060.obj");
  EXPECT_EQ(SeriesPath("out/a b.v2.png", 1), "out/a b.v2_000001.png");
  EXPECT_EQ(SeriesPath("/s.ply", 999'999), "/s_999999.ply");
  EXPECT_EQ(SeriesPath("out.d/s", 7), "out.d/s_000007");
}

TEST(SeriesPathTest, GrowsBeyondSixDigits) {
  EXPECT_EQ(SeriesPath("s.obj", 1'000'000), "s_1000000.obj");
  EXPECT_EQ(SeriesPath("s.obj", std::numeric_limits<uint64_t>::max()),
            "s_18446744073709551615.obj");
}

}  // namespace
}  // namespace drape::cli
