// The content of pictures, measured in their pixels. Edges are antialiased, so a share of the
// pixels along a perimeter may count either way; this gives the tolerances of counts.
#include "server/render/gl_draw/gl_renderer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "server/scene/distance_map.h"
#include "tests/gl_draw/pictures.h"
#include "tests/support/solids/solids.h"

namespace drape::render {
namespace {

using Eigen::Vector3d;

DrawnCloth At(std::shared_ptr<const SceneModel> model,
              const Vector3d& environment = Vector3d::Zero(),
              std::vector<Collider> colliders = {}) {
  return {.model = std::move(model),
          .placement = {.environment_origin_m = environment},
          .colliders = std::move(colliders)};
}

class GlRendererTest : public PictureTest {
 protected:
  // The backdrop alone.
  static Picture Empty(PictureSpec spec) {
    spec.camera = FrontCamera(Vector3d::Zero(), 10, 2);
    spec.has_legend = false;
    return Draw(spec, {}, {});
  }
  // Every pixel but the backdrop.
  static Patch Shown(const Picture& picture) {
    return Difference(picture, Empty(SmallSpec(picture.width_px, picture.height_px)));
  }
};

TEST_F(GlRendererTest, ASquareCoversWhatItShould) {
  PictureSpec spec = SmallSpec(240, 200);
  spec.camera = FrontCamera({0.5, 0.5, 0}, 10, 2);  // 100 px per metre
  const std::vector<DrawnCloth> cloths = {At(GridModel(6))};
  const Patch shown = Shown(Draw(spec, cloths, HostStates(cloths, Upright)));
  EXPECT_NEAR(static_cast<double>(shown.count), 100 * 100, 4 * 100);
  EXPECT_NEAR(shown.centroid.x(), 120, 0.5);
  EXPECT_NEAR(shown.centroid.y(), 100, 0.5);
}

TEST_F(GlRendererTest, ClothsAreWhereTheyAreInTheWorld) {
  PictureSpec spec = SmallSpec(400, 200);
  spec.camera = FrontCamera({0, 0, 0}, 10, 2);
  const auto model = GridModel(4, 0.4);
  // Centres at (-1, -0.3) and (1, 0.5), through both parts of a placement.
  const std::vector<DrawnCloth> cloths = {
      At(model, {-1.2, -0.5, 0}),
      {.model = model,
       .placement = {.environment_origin_m = {0, 0.3, 0}, .origin_in_environment_m = {0.8, 0, 0}},
       .colliders = {}}};
  const Picture picture = Draw(spec, cloths, HostStates(cloths, Upright));
  const Picture empty = Empty(SmallSpec(400, 200));
  const auto half = [&](bool is_left) {
    return Count(picture, [&](size_t x, size_t y, const Rgb& pixel) {
      return (x < 200) == is_left && Distance(pixel, PixelOf(empty, x, y)) > 8;
    });
  };
  for (const auto& [patch, x, y] :
       {std::tuple(half(true), 100.0, 130.0), std::tuple(half(false), 300.0, 50.0)}) {
    EXPECT_NEAR(static_cast<double>(patch.count), 40 * 40, 4 * 40);
    EXPECT_NEAR(patch.centroid.x(), x, 0.5);
    EXPECT_NEAR(patch.centroid.y(), y, 0.5);
  }
  // The first two colours of the palette.
  EXPECT_GT((half(true).mean_rgb - half(false).mean_rgb).norm(), 60);
}

// The point of a pixel at which its depth is known lies anywhere in it.
TEST_F(GlRendererTest, DepthsAreDistancesAlongTheLineOfView) {
  PictureSpec spec = SmallSpec(240, 200);
  spec.has_depths = true;
  spec.has_pins = false;
  spec.camera = FrontCamera({0.5, 0.5, 0}, 10, 2);  // 100 px per metre at 10 m
  const std::vector<DrawnCloth> cloths = {At(GridModel(6), {1e5, 0, -3e4})};
  spec.camera->eye_m += Vector3d(1e5, 0, -3e4);
  spec.camera->target_m += Vector3d(1e5, 0, -3e4);
  // At 0, and leaning back by up to 2 m per metre of its height.
  for (const double slope : {0.0, 0.5, -2.0}) {
    SCOPED_TRACE(slope);
    const auto leaning = [slope](const Vector3d& p) {
      return Vector3d(p.x(), p.z(), slope * (p.z() - 0.5));
    };
    const Picture picture = Draw(spec, cloths, HostStates(cloths, leaning));
    ASSERT_EQ(picture.depths_m.size(), 240u * 200);
    size_t seen = 0;
    for (size_t y = 0; y < 200; ++y) {
      for (size_t x = 0; x < 240; ++x) {
        const float depth_m = picture.depths_m[240 * y + x];
        if (std::isinf(depth_m)) continue;
        ++seen;
        // The ray (u, v, 1) d meets the sheet where 10 - d = slope v d.
        const double v = (100 - (static_cast<double>(y) + 0.5)) / 1000;
        const double expected_m = 10 / (1 + slope * v);
        // Half a pixel, and single precision of a plane far outside the picture.
        const double half_pixel_m = std::abs(slope) * 0.5e-3 * expected_m * expected_m / 10;
        ASSERT_NEAR(depth_m, expected_m, half_pixel_m + 1e-5 * expected_m) << x << ", " << y;
      }
    }
    // The sheet is seen under its height at the middle of its depth, and nothing else is.
    EXPECT_NEAR(static_cast<double>(seen), 100 * 100, slope == 0 ? 400 : 1500);
  }
  EXPECT_TRUE(Draw(SmallSpec(), cloths, HostStates(cloths)).depths_m.empty());
}

TEST_F(GlRendererTest, DepthsOfPlanesDoNotChangeThePicture) {
  PictureSpec spec = SmallSpec(200, 200);
  spec.camera = Camera{.eye_m = {0.25, 2, 0.26}, .target_m = {0.25, 0, 0.25}};
  const std::vector<DrawnCloth> cloths = {
      At(GridModel(8, 0.5), Vector3d::Zero(), {PlaneThrough({0, -0.3, 0}, Vector3d::UnitY())})};
  const Picture without = Draw(spec, cloths, HostStates(cloths));
  spec.has_depths = true;
  const Picture with = Draw(spec, cloths, HostStates(cloths));
  EXPECT_EQ(with.rgb, without.rgb);
  // The cloth at 0 in the middle, the floor at -0.3 in a corner, drawn 0.2 % of the scene lower.
  EXPECT_NEAR(with.depths_m[200 * 100 + 100], 2, 0.02);
  EXPECT_NEAR(with.depths_m[200 * 5 + 5], 2.3, 0.03);
}

// A square's edge at a slant: with one sample a pixel is the cloth or the backdrop, with four there
// are pixels between them.
TEST_F(GlRendererTest, OneSampleLeavesEdgesJagged) {
  PictureSpec spec = SmallSpec();
  spec.camera = FrontCamera({0.5, 0.5, 0}, 10, 2);
  const std::vector<DrawnCloth> cloths = {At(GridModel(6))};
  const Map turned = [](const Vector3d& p) {
    return Vector3d(p.x() + 0.3 * p.z(), p.z() - 0.3 * p.x(), 0);
  };
  const auto between = [&](uint32_t samples) {
    spec.samples = samples;
    const Picture picture = Draw(spec, cloths, HostStates(cloths, turned));
    const Picture empty = Empty(SmallSpec());
    // Every colour of the cloth is as far from the backdrop as its middle, or nearly.
    const int far = Distance(PixelOf(picture, 110, 100), PixelOf(empty, 110, 100));
    return Count(picture,
                 [&](size_t x, size_t y, const Rgb& pixel) {
                   const int distance = Distance(pixel, PixelOf(empty, x, y));
                   return distance > 8 && distance < 0.7 * far;
                 })
        .count;
  };
  EXPECT_EQ(between(1), 0u);
  EXPECT_GT(between(4), 50u);
}

TEST_F(GlRendererTest, NothingIsInShadowWithoutThem) {
  PictureSpec spec = SmallSpec(200, 200);
  spec.samples = 1;  // no pixel has the mean of two colours
  spec.camera = Camera{.eye_m = {0.25, 2, 0.26}, .target_m = {0.25, 0, 0.25}};
  const std::vector<DrawnCloth> cloths = {
      At(GridModel(8, 0.5), Vector3d::Zero(), {PlaneThrough({0, -0.3, 0}, Vector3d::UnitY())})};
  const auto floor_beside_cloth = [&](bool has_shadows) {
    spec.has_shadows = has_shadows;
    const Picture picture = Draw(spec, cloths, HostStates(cloths));
    // The floor is grey, the cloth green.
    return Count(picture,
                 [](size_t, size_t, const Rgb& pixel) {
                   return pixel.green < 200 && pixel.red > 0.8 * pixel.green;
                 })
        .count;
  };
  EXPECT_GT(floor_beside_cloth(true), 200u);
  EXPECT_EQ(floor_beside_cloth(false), 0u);
}

TEST_F(GlRendererTest, FrontAndBackDiffer) {
  PictureSpec spec = SmallSpec();
  spec.camera = FrontCamera({0.5, 0.5, 0}, 10, 1);
  const std::vector<DrawnCloth> cloths = {At(GridModel(4))};
  const auto centre = [&](const Map& map) {
    return PixelOf(Draw(spec, cloths, HostStates(cloths, map)), 100, 100);
  };
  const Rgb one = centre(Upright);
  const Rgb other = centre([](const Vector3d& p) { return Vector3d(1 - p.x(), p.z(), 0); });
  EXPECT_GT(Distance(one, other), 20);
}

TEST_F(GlRendererTest, ASphereHasItsRadius) {
  PictureSpec spec = SmallSpec(240, 240);
  spec.camera = FrontCamera(Vector3d::Zero(), 10, 1.2);
  // The cloth itself is far outside the picture.
  const std::vector<DrawnCloth> cloths = {
      At(GridModel(2, 0.001), {50, 0, 0}, {SphereAt({-50, 0, 0}, 0.4)})};
  const Patch shown = Shown(Draw(spec, cloths, HostStates(cloths)));
  // Its outline is seen under asin(r / d); drawn 0.4 % smaller (collider_shapes.h).
  const double drawn = 0.4 * 0.996;
  const double radius_px = 200 * 10 * std::tan(std::asin(drawn / 10));
  EXPECT_NEAR(std::sqrt(static_cast<double>(shown.count) / std::numbers::pi), radius_px, 0.7);
  EXPECT_NEAR(shown.centroid.x(), 120, 0.5);
  EXPECT_NEAR(shown.centroid.y(), 120, 0.5);
  spec.has_colliders = false;
  EXPECT_EQ(Shown(Draw(spec, cloths, HostStates(cloths))).count, 0u);
}

// A cube of 0.8 m, a diamond from the front, and the same mesh again beside it, upright.
TEST_F(GlRendererTest, MeshesAreWhereTheirCollidersAre) {
  PictureSpec spec = SmallSpec(480, 240);
  spec.camera = FrontCamera(Vector3d::Zero(), 10, 1.2);
  const Vector3d half = Vector3d::Constant(0.2);
  const auto map =
      DistanceMap::Build(test::BoxMesh(Vector3d(1, 2, 3) - half, Vector3d(1, 2, 3) + half),
                         {.resolution = 8})
          .value();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(std::numbers::pi / 4, Vector3d::UnitZ()));
  const Vector3d left(-0.5, 0.1, 0), right(0.5, -0.1, 0), mesh_center(1, 2, 3);
  const std::vector<DrawnCloth> cloths = {
      At(GridModel(2, 0.001), {50, 0, 0},
         {DistanceMapAt(map, {left - Vector3d(50, 0, 0) - turn * mesh_center, turn}),
          DistanceMapAt(map, {right - Vector3d(50, 0, 0) - mesh_center, {1, 0, 0, 0}})})};
  const Picture picture = Draw(spec, cloths, HostStates(cloths));
  const Picture empty = Empty(SmallSpec(480, 240));
  // The front faces are 9.8 m away; 200 pixels per metre at 10 m. Drawn 0.3 of the
  // cloth's edge smaller, 0.3 mm.
  const double side_px = 0.4 * 200 * 10 / 9.8;
  for (const bool is_left : {true, false}) {
    const Patch patch = Count(picture, [&](size_t x, size_t y, const Rgb& pixel) {
      return (x < 240) == is_left && Distance(pixel, PixelOf(empty, x, y)) > 8;
    });
    // The sides are visible towards the middle by at most 0.3 m (1/9.8 - 1/10.2) 2000 px = 2.4 px.
    EXPECT_GT(static_cast<double>(patch.count), side_px * (side_px - 2));
    EXPECT_LT(static_cast<double>(patch.count), (side_px + 2.4 + 2) * (side_px + 2.4 + 2));
    EXPECT_NEAR(patch.centroid.x(), is_left ? 140 : 340, 3);
    EXPECT_NEAR(patch.centroid.y(), is_left ? 100 : 140, 3);
  }
  spec.has_colliders = false;
  EXPECT_EQ(Shown(Draw(spec, cloths, HostStates(cloths))).count, 0u);
}

TEST_F(GlRendererTest, ClothHidesTheSphereThatItLiesOn) {
  const double radius_m = 0.4;
  // A dome of particles on the sphere, as the solver leaves them.
  const Map on_sphere = [radius_m](const Vector3d& p) {
    const Vector3d flat(p.x() - 0.25, p.z() - 0.25, 0.45);
    return Vector3d(radius_m * flat.normalized());
  };
  PictureSpec spec = SmallSpec(300, 300);
  spec.camera = FrontCamera(Vector3d::Zero(), 10, 1);
  const std::vector<DrawnCloth> bare = {At(GridModel(16, 0.5))};
  const std::vector<DrawnCloth> lying = {
      At(GridModel(16, 0.5), Vector3d::Zero(), {SphereAt(Vector3d::Zero(), radius_m)})};
  const Picture cloth_alone = Draw(spec, bare, HostStates(bare, on_sphere));
  const Picture with_sphere = Draw(spec, lying, HostStates(lying, on_sphere));
  const Picture empty = Empty(SmallSpec(300, 300));
  // The cloth hides everything behind it: except at its edge, every pixel stays (objects behind it
  // cast no shadow on it).
  const Patch changed = Count(with_sphere, [&](size_t x, size_t y, const Rgb& pixel) {
    return Distance(PixelOf(cloth_alone, x, y), PixelOf(empty, x, y)) > 8 &&
           Distance(pixel, PixelOf(cloth_alone, x, y)) > 30;
  });
  EXPECT_LE(changed.count, 4u * 110);                            // about the perimeter of the cloth
  EXPECT_GT(Difference(with_sphere, cloth_alone).count, 2000u);  // the sphere around it
}

TEST_F(GlRendererTest, APlaneFillsTheViewAndTakesTheShadow) {
  PictureSpec spec = SmallSpec(300, 300);
  spec.view_direction = {0, -1, -0.4};
  const std::vector<DrawnCloth> floating = {At(GridModel(8, 0.5), Vector3d::Zero())};
  const std::vector<DrawnCloth> above = {
      At(GridModel(8, 0.5), Vector3d::Zero(), {PlaneThrough({0, -0.3, 0}, Vector3d::UnitY())})};
  const Picture without = Draw(spec, floating, HostStates(floating));
  const Picture with = Draw(spec, above, HostStates(above));
  // It fades out towards the edges of the picture.
  EXPECT_GT(Difference(with, without, 3).count, 300u * 300 / 3);
  const Picture empty = Empty(SmallSpec(300, 300));
  // Some of the floor is in the shadow: much darker than most of it.
  const Patch dark = Count(with, [&](size_t x, size_t y, const Rgb& pixel) {
    return Distance(PixelOf(without, x, y), PixelOf(empty, x, y)) <= 8 && pixel.green < 185;
  });
  EXPECT_GT(dark.count, 300u);
}

TEST_F(GlRendererTest, PinsAreShownUnlessHidden) {
  PictureSpec spec = SmallSpec(300, 300);
  const auto is_red = [](size_t, size_t, const Rgb& pixel) {
    return pixel.red > 110 && pixel.green < pixel.red / 2 && pixel.blue < pixel.red / 2;
  };
  const std::vector<DrawnCloth> cloths = {At(GridModel(9, 1, {0, 8}))};
  const Picture with = Draw(spec, cloths, HostStates(cloths));
  EXPECT_GT(Count(with, is_red).count, 2u * 3);  // of each the part that is whole pixels
  spec.has_pins = false;
  const Picture without = Draw(spec, cloths, HostStates(cloths));
  EXPECT_EQ(Count(without, is_red).count, 0u);
  // Two balls of at least 1.5 px radius.
  EXPECT_GT(Difference(with, without).count, 2u * 7);
}

TEST_F(GlRendererTest, AFittedCameraFillsThePicture) {
  PictureSpec spec = SmallSpec(300, 200);
  for (const Vector3d& view : {Vector3d(0, 0, -1), Vector3d(-0.55, -0.42, -0.72)}) {
    spec.view_direction = view;
    for (const double stretch : {0.3, 1.0, 5.0}) {
      const std::vector<DrawnCloth> cloths = {At(GridModel(8), {100, -20, 3})};
      const DrawnStates states = HostStates(
          cloths, [&](const Vector3d& p) { return Vector3d(stretch * p.x(), p.z(), 0.2 * p.x()); });
      const Picture picture = Draw(spec, cloths, states);
      const Picture empty = Empty(SmallSpec(300, 200));
      Eigen::AlignedBox2d shown;
      Count(picture, [&](size_t x, size_t y, const Rgb& pixel) {
        if (Distance(pixel, PixelOf(empty, x, y)) > 8) {
          shown.extend(Eigen::Vector2d(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5));
        }
        return false;
      });
      const Eigen::Vector2d fill(shown.sizes().x() / 300, shown.sizes().y() / 200);
      // 85 % in one direction, less the margin for pins; the pixels of a sharp corner are faint.
      EXPECT_NEAR(fill.maxCoeff(), 0.84, 0.03) << stretch;
      EXPECT_NEAR(shown.center().x(), 150, 8);
      EXPECT_NEAR(shown.center().y(), 100, 8);
      EXPECT_NEAR(picture.bounds_m.min().x(), 100, 1e-6);
      EXPECT_NEAR(picture.bounds_m.max().x(), 100 + stretch, 1e-6 * (100 + stretch));
    }
  }
}

TEST_F(GlRendererTest, IncludedBoxesWidenTheView) {
  PictureSpec spec = SmallSpec();
  const std::vector<DrawnCloth> cloths = {At(GridModel(4))};
  const size_t before = Shown(Draw(spec, cloths, HostStates(cloths))).count;
  spec.include_m = Eigen::AlignedBox3d(Vector3d(-1, -1, -1), Vector3d(2, 2, 2));
  const Picture wider = Draw(spec, cloths, HostStates(cloths));
  EXPECT_LT(Shown(wider).count, before / 4);
  EXPECT_TRUE(wider.bounds_m.isApprox(spec.include_m));
}

TEST_F(GlRendererTest, FarAwayIsTheSamePicture) {
  PictureSpec spec = SmallSpec(300, 300);
  const auto model = GridModel(12, 1, {0, 11});
  const std::vector<Collider> colliders = {SphereAt({0.5, -0.4, 0.5}, 0.3),
                                           PlaneThrough({0, -0.8, 0}, Vector3d::UnitY())};
  const std::vector<DrawnCloth> here = {At(model, Vector3d::Zero(), colliders)};
  const std::vector<DrawnCloth> far = {At(model, {1e6, 2e6, -3e6}, colliders)};
  const Map wavy = [](const Vector3d& p) {
    return Vector3d(p.x(), 0.1 * std::sin(7 * p.x()), p.z());
  };
  const Picture one = Draw(spec, here, HostStates(here, wavy));
  const Picture other = Draw(spec, far, HostStates(far, wavy));
  // Edges of shadows and lines of the grid may move by a little of a pixel.
  EXPECT_LT(Difference(one, other, 12).count, 300u * 300 / 200);
}

TEST_F(GlRendererTest, WhatIsNotFiniteIsLeftOut) {
  const std::vector<DrawnCloth> cloths = {At(GridModel(6, 1, {0})), At(ChainModel(5))};
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
    for (const Colouring colouring :
         {Colouring::kMaterial, Colouring::kStrain, Colouring::kColourGroup, Colouring::kSpeed}) {
      PictureSpec spec = SmallSpec();
      spec.colouring = colouring;
      DrawnStates states = HostStates(cloths, AsItIs, [](const Vector3d&) { return 1.0; });
      auto& positions = std::get<std::vector<double>>(states.host.positions_m);
      auto& velocities = std::get<std::vector<double>>(states.host.velocities_m_per_s);
      positions[3 * 14] = bad;      // inside the grid
      positions[3 * 38 + 1] = bad;  // in the chain
      velocities[3 * 7 + 2] = bad;
      const Picture picture = Draw(spec, cloths, states);
      EXPECT_LE(picture.bounds_m.diagonal().norm(), 2);
      EXPECT_GT(Shown(picture).count, 500u);
      std::fill(positions.begin(), positions.end(), bad);
      EXPECT_TRUE(Draw(spec, cloths, states).bounds_m.diagonal().allFinite());
    }
  }
}

TEST_F(GlRendererTest, AHoleIsWhereTheParticleWas) {
  PictureSpec spec = SmallSpec();
  spec.camera = FrontCamera({0.5, 0.5, 0}, 10, 1);  // the grid fills the picture
  const std::vector<DrawnCloth> cloths = {At(GridModel(5))};
  DrawnStates states = HostStates(cloths, Upright);
  auto& positions = std::get<std::vector<double>>(states.host.positions_m);
  positions[3 * 12] = std::numeric_limits<double>::quiet_NaN();  // the middle of 5 x 5
  const Picture picture = Draw(spec, cloths, states);
  const Picture empty = Empty(spec);
  // The six triangles around it: half of them in each of two squares, all of two: 6 * 25 * 25 / 2
  // * 4.
  const Patch hole = Count(picture, [&](size_t x, size_t y, const Rgb& pixel) {
    return Distance(pixel, PixelOf(empty, x, y)) <= 8;
  });
  EXPECT_NEAR(static_cast<double>(hole.count), 6 * 50 * 50 / 2, 400);
  EXPECT_NEAR(hole.centroid.x(), 100, 3);
  EXPECT_NEAR(hole.centroid.y(), 100, 3);
}

TEST_F(GlRendererTest, ChainsAreLinesWithBalls) {
  PictureSpec spec = SmallSpec(300, 300);
  spec.camera = FrontCamera({0.5, 0, 0}, 10, 1.2);  // 250 px per metre
  const std::vector<DrawnCloth> cloths = {At(ChainModel(11))};
  const Patch shown = Shown(Draw(spec, cloths, HostStates(cloths)));
  // Ribbons of 2 * 0.045 of 25 px, eleven balls of radius 0.1 of 25 px.
  const double expected = 250 * 2.25 + 11 * (std::numbers::pi * 2.5 * 2.5 - 5 * 2.25);
  EXPECT_NEAR(static_cast<double>(shown.count), expected, 0.45 * expected);
  EXPECT_NEAR(shown.centroid.x(), 150, 1);
  EXPECT_NEAR(shown.centroid.y(), 150, 1);
}

TEST_F(GlRendererTest, ManyClothsOfSeveralModels) {
  PictureSpec spec = SmallSpec(320, 320);
  spec.camera = FrontCamera({4, 4, 0}, 30, 8);  // 40 px per metre
  const std::vector<std::shared_ptr<const SceneModel>> models = {
      GridModel(4, 0.5), GridModel(5, 0.5), GridModel(6, 0.5)};
  std::vector<DrawnCloth> cloths;
  for (int k = 0; k < 64; ++k) {
    cloths.push_back(At(models[static_cast<size_t>(k % 3)],
                        {0.25 + k % 8, 0.25 + k / 8, 0}));  // NOLINT: whole rows
  }
  const Picture picture = Draw(spec, cloths, HostStates(cloths, Upright));
  const Picture empty = Empty(SmallSpec(320, 320));
  for (size_t row = 0; row < 8; ++row) {
    for (size_t column = 0; column < 8; ++column) {
      const Patch one = Count(picture, [&](size_t x, size_t y, const Rgb& pixel) {
        return x / 40 == column && y / 40 == row && Distance(pixel, PixelOf(empty, x, y)) > 8;
      });
      EXPECT_NEAR(static_cast<double>(one.count), 20 * 20, 4 * 20) << row << " " << column;
      EXPECT_NEAR(one.centroid.x(), 40 * static_cast<double>(column) + 20, 1);
      EXPECT_NEAR(one.centroid.y(), 40 * static_cast<double>(row) + 20, 1);
    }
  }
}

TEST_F(GlRendererTest, TinyPicturesAreDrawnAndHugeOnesRefused) {
  const std::vector<DrawnCloth> cloths = {At(GridModel(4))};
  for (const auto& [width, height] : {std::pair(16u, 16u), std::pair(16u, 900u)}) {
    for (const Colouring colouring : {Colouring::kMaterial, Colouring::kColourGroup}) {
      PictureSpec spec = SmallSpec(width, height);
      spec.colouring = colouring;
      const Patch shown = Shown(Draw(spec, cloths, HostStates(cloths)));
      EXPECT_GT(shown.count, 16u);
    }
  }
  const Result<Picture> huge = renderer_->Draw(SmallSpec(1u << 20, 16), cloths, HostStates(cloths));
  ASSERT_FALSE(huge.ok());
  EXPECT_EQ(huge.status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(huge.status().reason(), "DEVICE_MEMORY");
  // It still draws.
  EXPECT_GT(Shown(Draw(SmallSpec(), cloths, HostStates(cloths))).count, 1000u);
}

class GlRendererLong : public GlRendererTest {};

TEST_F(GlRendererLong, TheLargestPictureWorksOrIsRefused) {
  PictureSpec spec = SmallSpec(4096, 4096);
  spec.camera = FrontCamera({0.5, 0.5, 0}, 10, 4);  // 1024 px per metre
  const std::vector<DrawnCloth> cloths = {At(GridModel(4))};
  const Result<Picture> picture = renderer_->Draw(spec, cloths, HostStates(cloths, Upright));
  if (picture.ok()) {
    EXPECT_NEAR(static_cast<double>(Shown(*picture).count), 1024.0 * 1024, 4 * 1024);
  } else {
    EXPECT_EQ(picture.status().reason(), "DEVICE_MEMORY");
  }
}

// Each cylinder has 384 triangles; together they have 128 more than the limit.
TEST_F(GlRendererTest, TooManyTrianglesOfCylindersAreRefused) {
  std::vector<Collider> cylinders;
  for (uint32_t k = 0; k < 10923; ++k) {
    cylinders.push_back(CylinderBetween({0.01 * k, 0, 0}, {0.01 * k, 1, 0}, 0.1));
  }
  const std::vector<DrawnCloth> cloths = {At(ChainModel(2), Vector3d::Zero(), cylinders)};
  const Result<Picture> picture = renderer_->Draw(SmallSpec(), cloths, HostStates(cloths));
  ASSERT_FALSE(picture.ok());
  EXPECT_EQ(picture.status().reason(), "PICTURE_TOO_LARGE");
  EXPECT_THAT(
      picture.status().message(),
      testing::HasSubstr("the limit of triangles of mesh and cylinder colliders is 4194304: "
                         "4194432 wanted"));
}

TEST_F(GlRendererTest, SamePictureTwice) {
  PictureSpec spec = SmallSpec();
  spec.colouring = Colouring::kStrain;
  const std::vector<DrawnCloth> cloths = {At(GridModel(16, 1, {0}))};
  const Map wavy = [](const Vector3d& p) {
    return Vector3d(p.x(), 0.1 * std::sin(9 * p.x() * p.z()), p.z());
  };
  EXPECT_EQ(Draw(spec, cloths, HostStates(cloths, wavy)).rgb,
            Draw(spec, cloths, HostStates(cloths, wavy)).rgb);
}

}  // namespace
}  // namespace drape::render
