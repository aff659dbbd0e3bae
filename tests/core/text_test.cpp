#include "server/core/text.h"

#include <gtest/gtest.h>

namespace drape {
namespace {

TEST(Shortened, CutsBetweenCharacters) {
  EXPECT_EQ(Shortened("short", 5), "short");
  EXPECT_EQ(Shortened("longer", 5), "lo...");
  EXPECT_EQ(Shortened("aäöü", 6), "aä...");  // the cut would fall into the ö
  EXPECT_EQ(Shortened("äöü", 5), "ä...");
  EXPECT_EQ(Shortened("\u20ac\u20ac", 5), "...");
}

}  // namespace
}  // namespace drape
