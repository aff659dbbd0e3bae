#include "client/cli/printable.h"

#include <gtest/gtest.h>

namespace drape::cli {
namespace {

TEST(Printable, ControlCharactersAreShownAsNumbers) {
  EXPECT_EQ(Printable("cloth 7, Größe \u20ac"), "cloth 7, Größe \u20ac");
  EXPECT_EQ(Printable("\x1b[2Jx\n\t\x7f"), "\\x1B[2Jx\\x0A\\x09\\x7F");
  EXPECT_EQ(Printable("a\u009bb"), "a\\xC2\\x9Bb");  // the control sequence introducer as one
}

// A terminal would show what follows the first from right to left.
TEST(Printable, CharactersThatTurnTheTextAreShownAsNumbers) {
  EXPECT_EQ(Printable("a\u202egnp"), "a\\xE2\\x80\\xAEgnp");
  EXPECT_EQ(Printable("\u2066\u2069\u200f\u061c\u2028"),
            "\\xE2\\x81\\xA6\\xE2\\x81\\xA9\\xE2\\x80\\x8F\\xD8\\x9C\\xE2\\x80\\xA8");
  EXPECT_EQ(Printable("שלום “x” … – ﷼"), "שלום “x” … – ﷼");
  EXPECT_EQ(Printable("\xE2\x80"), "\xE2\x80") << "cut off";
}

}  // namespace
}  // namespace drape::cli
