#include "server/render/gl_draw/palette.h"

#include <gtest/gtest.h>

#include <cmath>

namespace drape::render {
namespace {

TEST(PaletteTest, ColoursAreDistinct) {
  const auto distance = [](const shader::vec4& a, const shader::vec4& b) {
    return std::abs(a.x - b.x) + std::abs(a.y - b.y) + std::abs(a.z - b.z);
  };
  for (uint32_t a = 0; a < 32; ++a) {
    for (uint32_t b = 0; b < a; ++b) {
      EXPECT_GT(distance(GroupColour(a), GroupColour(b)), 0.03) << a << " " << b;
    }
  }
  for (uint32_t a = 0; a < 8; ++a) {
    for (uint32_t b = 0; b < a; ++b) {
      EXPECT_GT(distance(ClothColour(a), ClothColour(b)), 0.1) << a << " " << b;
    }
    EXPECT_EQ(distance(ClothColour(a), ClothColour(a + 8)), 0);
  }
  for (uint32_t group = 0; group < 2047; ++group) {
    const shader::vec4 colour = GroupColour(group);
    for (const float channel : {colour.x, colour.y, colour.z}) {
      EXPECT_GE(channel, 0);
      EXPECT_LE(channel, 1);
    }
  }
  EXPECT_FLOAT_EQ(LinearFromHex(0xff0000).x, 1);
  EXPECT_NEAR(LinearFromHex(0x808080).y, 0.2158605, 1e-6);  // the standard's formula
}

}  // namespace
}  // namespace drape::render
