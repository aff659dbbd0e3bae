#include "server/render/tiles.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/scheduler/fake_backend.h"

namespace drape::render {
namespace {

using testing::ElementsAre;

// Remembers what it is asked for; the pixels of picture k are k + 1.
class RecordingRenderer final : public Renderer {
 public:
  std::string device() const override { return "recording"; }
  bool takes_device_copies() const override { return false; }
  Result<Picture> Draw(const PictureSpec& spec, std::span<const DrawnCloth> cloths,
                       const DrawnStates& states) override {
    EXPECT_EQ(cloths.size(), 1u);
    EXPECT_EQ(states.row_total, row_total);
    first_rows.push_back(states.first_row);
    eyes_m.push_back(spec.camera->eye_m.x());
    Picture picture;
    picture.width_px = spec.width_px;
    picture.height_px = spec.height_px;
    if (spec.has_depths) picture.depths_m = {1, 2};
    picture.rgb.assign(size_t{3} * spec.width_px * spec.height_px,
                       static_cast<uint8_t>(first_rows.size()));
    return picture;
  }

  uint32_t row_total = 0;
  std::vector<uint32_t> first_rows;
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
  spec.width_px = 2;
  spec.height_px = 1;
  spec.camera = Camera{.eye_m = {0.5, 0, 1}};
  return spec;
}

TEST(Tiles, EachClothIsDrawnAloneWithItsRowsAndItsCamera) {
  RecordingRenderer renderer;
  renderer.row_total = 9;
  DrawnStates states;
  const auto all = DrawTiles(renderer, SmallSpec(), Cloths(), states, [] { return false; });
  ASSERT_TRUE(all.ok());
  EXPECT_THAT(renderer.first_rows, ElementsAre(0, 4, 6));
  EXPECT_THAT(renderer.eyes_m, ElementsAre(0.5, 10.5, 20.5));
  EXPECT_EQ(all->width_px, 2u);
  EXPECT_EQ(all->height_px, 3u);
  EXPECT_EQ(all->camera.eye_m.x(), 0.5);
  EXPECT_THAT(all->rgb, ElementsAre(1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3));
  EXPECT_EQ(states.first_row + states.row_total, 0u);
  EXPECT_TRUE(all->depths_m.empty());
  PictureSpec with_depths = SmallSpec();
  with_depths.has_depths = true;
  const auto deep = DrawTiles(renderer, with_depths, Cloths(), states, [] { return false; });
  EXPECT_THAT(deep->depths_m, ElementsAre(1, 2, 1, 2, 1, 2));
}

TEST(Tiles, ACancelledRequestEndsBetweenTwo) {
  RecordingRenderer renderer;
  renderer.row_total = 9;
  DrawnStates states;
  states.first_row = 5;
  states.row_total = 7;
  const auto all = DrawTiles(renderer, SmallSpec(), Cloths(), states,
                             [&] { return renderer.first_rows.size() == 2; });
  EXPECT_EQ(all.status().reason(), "CANCELLED");
  EXPECT_EQ(renderer.first_rows.size(), 2u);
  EXPECT_EQ(states.first_row, 5u);
  EXPECT_EQ(states.row_total, 7u);
}

}  // namespace
}  // namespace drape::render
