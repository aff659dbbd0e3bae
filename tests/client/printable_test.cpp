#include "client/cli/printable.h"

#include <gtest/gtest.h>

namespace drape::cli {
namespace {

TEST(Printable, ControlCharactersAreShownAsNumbers) {
  EXPECT_EQ(Printable("cloth 7, Größe \u20ac"), "cloth 7, Größe \u20ac");
  EXPECT_EQ(Printable("\x1b[2Jx\n\t\x7f"), "\\x1B[2Jx\\x0A\\x09\\x7F");
  EXPECT_EQ(Printable("a\u009bb"), "a\\xC2\\x9Bb");  // the control sequence introducer as one
}

}  // namespace
}  // namespace drape::cli
