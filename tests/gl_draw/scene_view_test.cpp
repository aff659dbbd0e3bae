#include "server/render/gl_draw/scene_view.h"

#include <gtest/gtest.h>

#include "server/render/gl_draw/float_order.h"
#include "tests/gl_draw/pictures.h"

namespace drape::render {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

TEST(SceneViewTest, RangeIsTheOneAskedForOrThatOfTheValues) {
  PictureSpec spec;
  EXPECT_EQ(ScaleRange(spec, {1, 2}).high, 0);
  spec.colouring = Colouring::kStrain;
  EXPECT_EQ(ScaleRange(spec, {-0.02, 0.01}).low, -0.02);
  EXPECT_EQ(ScaleRange(spec, {-0.02, 0.01}).high, 0.02);
  // Round-off is not shown in full colours.
  EXPECT_EQ(ScaleRange(spec, {-1e-7, 1e-7}).high, 1e-4);
  spec.colouring = Colouring::kSpeed;
  EXPECT_EQ(ScaleRange(spec, {3, 4}).low, 3);
  EXPECT_EQ(ScaleRange(spec, {3, 4}).high, 4);
  EXPECT_EQ(ScaleRange(spec, {3, 3}).high, 3.001);
  spec.range = {{-7, 9}};
  EXPECT_EQ(ScaleRange(spec, {3, 4}).low, -7);
  EXPECT_EQ(ScaleRange(spec, {3, 4}).high, 9);
}

TEST(SceneViewTest, NothingFiniteShowsWhereTheClothBegan) {
  const std::vector<DrawnCloth> cloths = {
      {.model = GridModel(2), .placement = {.environment_origin_m = {5, 6, 7}}, .colliders = {}}};
  const PictureSpec spec;
  SceneView view = LookAt(spec, cloths, {}, {}, StartFit(spec), 1024);
  EXPECT_EQ(view.bounds_m.center(), Vector3d(5, 6, 7));
  EXPECT_TRUE(view.camera.eye_m.allFinite());
  EXPECT_GT(view.near_m, 0);
  view = LookAt(spec, {}, {}, {}, StartFit(spec), 1024);
  EXPECT_EQ(view.bounds_m.center(), Vector3d(0, 0, 0));
}

TEST(SceneViewTest, BoundsAreOfTheClothsAndTheBoxAskedFor) {
  PictureSpec spec;
  spec.include_m = AlignedBox3d(Vector3d(-1, 0, 0), Vector3d(0, 0, 4));
  ClothMeasures measures;
  measures.cloths.push_back({.box_m = {Vector3d(0, 0, 0), Vector3d(1, 2, 3)},
                             .origin_m = Vector3d::Zero(),
                             .reaches_m = {},
                             .margin_m = 0});
  DrawnSolid solid;
  solid.center_m = Vector3d(9, 1, 1);
  solid.radius_m = 1;
  const ColliderShapes shapes{.solids = {solid}, .planes = {}};
  const SceneView view = LookAt(spec, {}, measures, shapes, StartFit(spec), 1024);
  EXPECT_TRUE(view.bounds_m.isApprox(AlignedBox3d(Vector3d(-1, 0, 0), Vector3d(1, 2, 4))));
}

// The inverse of what shaders/lib/float_order.glsl does, which the ranges of pictures test as a
// whole.
TEST(FloatOrderTest, KeepsValueAndOrder) {
  const auto ordered = [](float value) {
    const auto bits = std::bit_cast<uint32_t>(value);
    return (bits & 0x80000000u) != 0 ? ~bits : bits | 0x80000000u;
  };
  const std::vector<float> ascending = {-1e30f, -2, -1.5f, -1e-40f, 0, 1e-40f, 0.25f, 3, 1e30f};
  for (size_t k = 0; k < ascending.size(); ++k) {
    EXPECT_EQ(FloatFromOrderedBits(ordered(ascending[k])), ascending[k]);
    if (k > 0) {
      EXPECT_LT(ordered(ascending[k - 1]), ordered(ascending[k]));
    }
  }
}

}  // namespace
}  // namespace drape::render
