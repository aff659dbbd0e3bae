#include "server/render/tiles.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/scheduler/fake_backend.h"

namespace drape::render {
namespace {

using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::SizeIs;

// Remembers what it is asked for; the pixels of picture k are k + 1.
class RecordingRenderer final : public Renderer {
 public:
  std::string device() const override { return "recording"; }
  bool takes_device_copies() const override { return false; }
  Result<Picture> Draw(const PictureSpec& spec, std::span<const DrawnCloth> cloths,
                       const DrawnStates& states) override {
    EXPECT_TRUE(spec.is_tiled);
    EXPECT_EQ(states.row_total, row_total);
    if (cloths.size() > most_tiles) {
      return Status(StatusCode::kResourceExhausted, "DEVICE_MEMORY", "no room");
    }
    first_rows.push_back(states.first_row);
    tiles.push_back(cloths.size());
    eyes_m.push_back(spec.camera->eye_m.x());
    const size_t pixels = size_t{spec.width_px} * spec.height_px * cloths.size();
    const auto number = static_cast<uint8_t>(first_rows.size());
    Picture picture;
    picture.width_px = spec.width_px;
    picture.height_px = spec.height_px * static_cast<uint32_t>(cloths.size());
    if (spec.has_depths) picture.depths_m.assign(pixels, number);
    picture.rgb.assign(3 * pixels, number);
    return picture;
  }

  uint32_t row_total = 0;
  size_t most_tiles = 1000;
  std::vector<uint32_t> first_rows;
  std::vector<size_t> tiles;
  std::vector<double> eyes_m;
};

// Three cloths of 4, 2 and 3 particles, 10 m apart.
std::vector<DrawnCloth> Cloths() {
  std::vector<DrawnCloth> cloths;
  for (const uint32_t particles : {4u, 2u, 3u}) {
    const Placement placement{
        .environment_origin_m = {10.0 * static_cast<double>(cloths.size()), 0, 0}};
    cloths.push_back({ChainModel(particles), placement, {}});
  }
  return cloths;
}

PictureSpec SmallSpec() {
  PictureSpec spec;
  spec.is_tiled = true;
  spec.width_px = 2;
  spec.height_px = 1;
  spec.camera = Camera{.eye_m = {0.5, 0, 1}};
  return spec;
}

std::vector<DrawnCloth> Equal(size_t count, uint32_t particles) {
  return std::vector<DrawnCloth>(count, {ChainModel(particles), {}, {}});
}

size_t PageOf(uint32_t width_px, uint32_t height_px, const std::vector<DrawnCloth>& cloths) {
  PictureSpec spec = SmallSpec();
  spec.width_px = width_px;
  spec.height_px = height_px;
  return NextPage(spec, cloths);
}

TEST(Tiles, APageHasALimitedNumberOfPixelsAndParticles) {
  EXPECT_EQ(PageOf(128, 128, Equal(64, 2)), 64u);
  // The shadows of small tiles are no smaller.
  EXPECT_EQ(PageOf(16, 16, Equal(64, 2)), 64u);
  EXPECT_EQ(PageOf(16, 128, Equal(64, 2)), 64u);
  EXPECT_EQ(PageOf(200, 16, Equal(64, 2)), 16u);
  EXPECT_EQ(PageOf(1024, 768, Equal(3, 2)), 1u);
  EXPECT_EQ(PageOf(4096, 4096, Equal(1, 2)), 1u);
  // Even: not 64 and 36.
  EXPECT_EQ(PageOf(128, 128, Equal(100, 2)), 50u);
  EXPECT_EQ(PageOf(128, 128, Equal(65, 2)), 33u);
  EXPECT_EQ(PageOf(128, 128, Equal(5, 100'000)), 2u);
  EXPECT_EQ(PageOf(128, 128, Equal(2, 300'000)), 1u);
}

TEST(Tiles, PagesHaveTheRowsOfTheirClothsAndAreOneBelowTheOther) {
  RecordingRenderer renderer;
  renderer.row_total = 9;
  PictureSpec spec = SmallSpec();
  spec.width_px = 1;
  spec.height_px = 700;  // a page each
  DrawnStates states;
  const auto all = DrawTiles(renderer, spec, Cloths(), states, [] { return false; });
  ASSERT_TRUE(all.ok());
  EXPECT_THAT(renderer.first_rows, ElementsAre(0, 4, 6));
  EXPECT_THAT(renderer.tiles, ElementsAre(1, 1, 1));
  // The renderer moves the camera with each cloth.
  EXPECT_THAT(renderer.eyes_m, ElementsAre(0.5, 0.5, 0.5));
  EXPECT_EQ(all->width_px, 1u);
  EXPECT_EQ(all->height_px, 2100u);
  EXPECT_EQ(all->camera.eye_m.x(), 0.5);
  ASSERT_EQ(all->rgb.size(), 3u * 2100);
  for (size_t page = 0; page < 3; ++page) {
    const std::vector<uint8_t> tile(all->rgb.begin() + static_cast<ptrdiff_t>(page * 2100),
                                    all->rgb.begin() + static_cast<ptrdiff_t>(page * 2100 + 2100));
    EXPECT_THAT(tile, Each(page + 1));
  }
  EXPECT_EQ(states.first_row + states.row_total, 0u);
  EXPECT_TRUE(all->depths_m.empty());
}

TEST(Tiles, ClothsOfAPageAreDrawnTogether) {
  RecordingRenderer renderer;
  renderer.row_total = 9;
  PictureSpec spec = SmallSpec();
  spec.has_depths = true;
  DrawnStates states;
  const auto all = DrawTiles(renderer, spec, Cloths(), states, [] { return false; });
  ASSERT_TRUE(all.ok());
  EXPECT_THAT(renderer.tiles, ElementsAre(3));
  EXPECT_EQ(all->height_px, 3u);
  EXPECT_THAT(all->rgb, AllOf(SizeIs(18), Each(1)));
  EXPECT_THAT(all->depths_m, AllOf(SizeIs(6), Each(1)));
}

TEST(Tiles, PagesThatDoNotFitAreHalved) {
  RecordingRenderer renderer;
  renderer.row_total = 9;
  renderer.most_tiles = 1;
  DrawnStates states;
  const auto all = DrawTiles(renderer, SmallSpec(), Cloths(), states, [] { return false; });
  ASSERT_TRUE(all.ok());
  EXPECT_THAT(renderer.first_rows, ElementsAre(0, 4, 6));
  EXPECT_EQ(all->height_px, 3u);
  renderer.most_tiles = 0;
  const auto none = DrawTiles(renderer, SmallSpec(), Cloths(), states, [] { return false; });
  EXPECT_EQ(none.status().reason(), "DEVICE_MEMORY");
}

TEST(Tiles, ACancelledRequestEndsBetweenTwoPages) {
  RecordingRenderer renderer;
  renderer.row_total = 9;
  PictureSpec spec = SmallSpec();
  spec.height_px = 700;
  DrawnStates states;
  states.first_row = 5;
  states.row_total = 7;
  const auto all =
      DrawTiles(renderer, spec, Cloths(), states, [&] { return renderer.first_rows.size() == 2; });
  EXPECT_EQ(all.status().reason(), "CANCELLED");
  EXPECT_EQ(renderer.first_rows.size(), 2u);
  EXPECT_EQ(states.first_row, 5u);
  EXPECT_EQ(states.row_total, 7u);
}

}  // namespace
}  // namespace drape::render
