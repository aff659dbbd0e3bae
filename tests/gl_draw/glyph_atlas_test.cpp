#include "server/render/gl_draw/glyph_atlas.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace drape::render {
namespace {

TEST(GlyphAtlasTest, CharactersAreDrawnAndMeasured) {
  const GlyphAtlas atlas = GlyphAtlas::Bake(20);
  ASSERT_EQ(atlas.texels().size(), size_t{atlas.width()} * atlas.height());
  for (const char character : {'0', 'W', '-', '%', '['}) {
    const Glyph& glyph = atlas.GlyphOf(character);
    ASSERT_GT(glyph.width, 0u);
    ASSERT_LE(glyph.left + glyph.width, atlas.width());
    ASSERT_LE(glyph.top + glyph.height, atlas.height());
    int darkest = 0;
    for (uint32_t y = 0; y < glyph.height; ++y) {
      for (uint32_t x = 0; x < glyph.width; ++x) {
        const size_t texel = size_t{glyph.top + y} * atlas.width() + glyph.left + x;
        darkest = std::max<int>(darkest, atlas.texels()[texel]);
      }
    }
    EXPECT_GT(darkest, 128) << character;
  }
  // Digits are equally wide, so that labels stand below each other; a minus is a dash.
  EXPECT_FLOAT_EQ(atlas.WidthOf("1111"), atlas.WidthOf("8888"));
  EXPECT_GT(atlas.GlyphOf('-').width, 2 * atlas.GlyphOf('-').height);
  EXPECT_EQ(&atlas.GlyphOf('\n'), &atlas.GlyphOf('?'));
  EXPECT_NEAR(atlas.digit_height(), 0.62 * 20, 2);
}

}  // namespace
}  // namespace drape::render
