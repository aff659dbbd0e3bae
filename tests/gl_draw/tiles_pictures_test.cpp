// Tiles of a page beside the same cloths in pictures of their own.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/render/gl_draw/gl_renderer.h"
#include "tests/gl_draw/pictures.h"

namespace drape::render {
namespace {

using Eigen::Vector3d;

class TilesPicturesTest : public PictureTest {
 protected:
  // Nine cloths of three models, each in an environment of its own, with a ball, a post, a cylinder
  // or a floor.
  static std::vector<DrawnCloth> Cloths() {
    const std::vector<std::shared_ptr<const SceneModel>> models = {
        GridModel(24, 0.5, {0, 23}), GridModel(4, 0.5, {0}), ChainModel(6)};
    const std::vector<std::vector<Collider>> colliders = {
        {SphereAt({0.25, -0.25, 0.25}, 0.2), PlaneThrough({0, -0.5, 0}, Vector3d::UnitY())},
        {CapsuleBetween({0.1, -0.3, 0}, {0.4, -0.2, 0.3}, 0.1),
         BoxAt({0.2, -0.5, 0.2}, {0.2, 0.05, 0.3})},
        {CylinderBetween({0.25, -0.5, 0.2}, {0.25, -0.1, 0.2}, 0.15)}};
    std::vector<DrawnCloth> cloths;
    for (size_t k = 0; k < 9; ++k) {
      cloths.push_back(
          {.model = models[k / 2 % 3],
           .placement = {.environment_origin_m = {3.0 * static_cast<double>(k), 1, -2},
                         .origin_in_environment_m = {0.01 * static_cast<double>(k), 0, 0}},
           .colliders = colliders[k % 3]});
    }
    return cloths;
  }
  static PictureSpec Spec(uint32_t width_px, uint32_t height_px) {
    PictureSpec spec = SmallSpec(width_px, height_px);
    spec.camera = Camera{.eye_m = {0.3, 0.6, 1.8}, .target_m = {0.25, -0.2, 0.2}};
    spec.has_depths = true;
    return spec;
  }
  static double Wave(const Vector3d& p) { return 0.05 * std::sin(20 * p.x() + 9 * p.z()); }
  static Vector3d Wavy(const Vector3d& p) { return {p.x(), Wave(p), p.z()}; }
};

// Devices round places to 1/256 of a pixel, in a page from its corner: along edges a sample of the
// four may change sides. A quarter of the light is 137 of 255 above black.
TEST_F(TilesPicturesTest, ATileIsThePictureOfItsClothAlone) {
  const std::vector<DrawnCloth> cloths = Cloths();
  const DrawnStates states =
      HostStates(cloths, Wavy, [](const Vector3d& p) { return p.x() + p.z(); });
  for (const Colouring colouring :
       {Colouring::kMaterial, Colouring::kStrain, Colouring::kColourGroup, Colouring::kSpeed}) {
    for (const bool is_large : {false, true}) {
      PictureSpec spec = is_large ? Spec(320, 240) : Spec(96, 64);
      spec.colouring = colouring;
      PictureSpec tiled = spec;
      tiled.is_tiled = true;
      const Result<Picture> page = renderer_->Draw(tiled, cloths, states);
      ASSERT_TRUE(page.ok()) << page.status().ToString();
      ASSERT_EQ(page->height_px, 9 * spec.height_px);
      const size_t size = size_t{spec.width_px} * spec.height_px;
      ASSERT_EQ(page->rgb.size(), 9 * 3 * size);
      ASSERT_EQ(page->depths_m.size(), 9 * size);
      DrawnStates own = states;
      for (uint32_t k = 0; k < 9; ++k) {
        SCOPED_TRACE(testing::Message()
                     << "tile " << k << ", colouring " << static_cast<int>(colouring));
        spec.camera = tiled.camera;
        spec.camera->eye_m += cloths[k].placement.environment_origin_m;
        spec.camera->target_m += cloths[k].placement.environment_origin_m;
        own.row_total = 0;
        for (const DrawnCloth& cloth : cloths) own.row_total += cloth.model->particle_count();
        const Picture alone = Draw(spec, {cloths[k]}, own);
        own.first_row += cloths[k].model->particle_count();
        Picture tile = alone;
        tile.rgb.assign(page->rgb.begin() + static_cast<ptrdiff_t>(3 * size * k),
                        page->rgb.begin() + static_cast<ptrdiff_t>(3 * size * (k + 1)));
        EXPECT_LE(Difference(tile, alone, 2).count, size / 500);
        EXPECT_EQ(Difference(tile, alone, 137).count, 0u);
        size_t deeper = 0;
        for (size_t pixel = 0; pixel < size; ++pixel) {
          const float in_page_m = page->depths_m[size * k + pixel], alone_m = alone.depths_m[pixel];
          if (std::isinf(alone_m) && std::isinf(in_page_m)) continue;
          deeper += !(std::abs(in_page_m - alone_m) <= 1e-3f * alone_m);
        }
        EXPECT_LE(deeper, size / 500);
      }
    }
  }
}

// Were a shadow map larger than its cell, or the taps too wide, the ball of one tile would darken
// the floor of the next.
TEST_F(TilesPicturesTest, ShadowsStayInTheirTile) {
  const auto model = GridModel(8, 0.5);
  const std::vector<Collider> floor = {PlaneThrough({0, -0.3, 0}, Vector3d::UnitY())};
  PictureSpec spec = Spec(128, 128);
  const auto page_of = [&](double height_m) {
    // Only the last cloth of four is lifted.
    std::vector<DrawnCloth> cloths(4, {model, {}, floor});
    DrawnStates states = HostStates(cloths, Wavy);
    auto& positions = std::get<std::vector<double>>(states.host.positions_m);
    for (size_t word = positions.size() / 4 * 3; word < positions.size(); ++word) {
      if (word % 3 == 1) positions[word] += height_m;
    }
    spec.is_tiled = true;
    const Result<Picture> page = renderer_->Draw(spec, cloths, states);
    DRAPE_CHECK(page.ok(), page.status().ToString());
    return *page;
  };
  const Picture low = page_of(0), high = page_of(0.2);
  const size_t tile = size_t{3} * 128 * 128;
  EXPECT_TRUE(std::equal(low.rgb.begin(), low.rgb.begin() + static_cast<ptrdiff_t>(3 * tile),
                         high.rgb.begin()));
  EXPECT_FALSE(std::equal(low.rgb.begin() + static_cast<ptrdiff_t>(3 * tile), low.rgb.end(),
                          high.rgb.begin() + static_cast<ptrdiff_t>(3 * tile)));
}

// Neither its lines nor where it fades out follow cloth that moves, grows or folds.
TEST_F(TilesPicturesTest, AFloorBehindAGivenCameraStaysWhereItIs) {
  const std::vector<DrawnCloth> cloths = {
      {.model = GridModel(4, 0.4),
       .placement = {},
       .colliders = {PlaneThrough({0, 0, 0}, Vector3d::UnitY())}}};
  PictureSpec spec = SmallSpec(200, 150);
  spec.camera = Camera{.eye_m = {1.5, 1.2, 1.5}, .target_m = {0, 0.1, 0}};
  const auto draw = [&](const Map& map) { return Draw(spec, cloths, HostStates(cloths, map)); };
  const Picture first = draw([](const Vector3d& p) { return Vector3d(p.x(), 0.02, p.z()); });
  for (const double size : {0.1, 0.5, 1.5}) {
    const Picture other = draw([&](const Vector3d& p) {
      return Vector3d(size * p.x() - 0.1, 0.02 + size * p.z(), size * p.z());
    });
    int difference = 0;
    for (size_t y = 100; y < 150; ++y) {
      for (size_t x = 0; x < 40; ++x) {
        difference = std::max(difference, Distance(PixelOf(first, x, y), PixelOf(other, x, y)));
      }
    }
    EXPECT_LE(difference, 1) << size;
  }
}

}  // namespace
}  // namespace drape::render
