#include "server/render/gl_draw/page_layout.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace drape::render {
namespace {

TEST(PageLayoutTest, APictureAloneHasAllOfItsImages) {
  const PageLayout layout{
      .tile_count = 1, .width_px = 960, .height_px = 720, .shadow_size_px = 2048};
  EXPECT_EQ(layout.picture_height_px(), 720u);
  EXPECT_EQ(layout.shadow_map_size_px(), 2048u);
  EXPECT_EQ(layout.PictureOf(0).y, 0u);
  const shader::vec4 cell = layout.ShadowCellOf(0, 2048);
  EXPECT_EQ(cell.x + cell.y, 0);
  EXPECT_EQ(cell.z, 1);
  EXPECT_EQ(cell.w, 1);
}

TEST(PageLayoutTest, TilesAreOneBelowTheOther) {
  const PageLayout layout{.tile_count = 3, .width_px = 8, .height_px = 5, .shadow_size_px = 16};
  EXPECT_EQ(layout.picture_height_px(), 15u);
  EXPECT_EQ(layout.PictureOf(0).y, 10u);
  EXPECT_EQ(layout.PictureOf(2).y, 0u);
  EXPECT_EQ(layout.PictureOf(1).width, 8u);
  EXPECT_EQ(layout.PictureOf(1).height, 5u);
}

// The filter reaches two texels beyond the edge of a cell; 3 keep two cells apart.
TEST(PageLayoutTest, ShadowCellsAreApartAndInTheMap) {
  for (const uint32_t count : {1u, 2u, 5u, 9u, 10u, 64u}) {
    const PageLayout layout{
        .tile_count = count, .width_px = 8, .height_px = 8, .shadow_size_px = 16};
    for (uint32_t a = 0; a < count; ++a) {
      const PixelBox one = layout.ShadowOf(a);
      EXPECT_EQ(one.width, 16u);
      EXPECT_LE(one.x + one.width, layout.shadow_map_size_px());
      EXPECT_LE(one.y + one.height, layout.shadow_map_size_px());
      for (uint32_t b = 0; b < a; ++b) {
        const PixelBox other = layout.ShadowOf(b);
        const auto gap = [](uint32_t p, uint32_t q) { return std::max(p, q) - std::min(p, q); };
        EXPECT_GE(std::max(gap(one.x, other.x), gap(one.y, other.y)), 16u + 3u);
      }
    }
  }
}

}  // namespace
}  // namespace drape::render
