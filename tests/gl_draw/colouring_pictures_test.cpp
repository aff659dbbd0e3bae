// The meaning of the colours of pictures.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "server/render/gl_draw/palette.h"
#include "tests/gl_draw/pictures.h"

namespace drape::render {
namespace {

using Eigen::Vector3d;

class ColouringTest : public PictureTest {
 protected:
  static std::vector<DrawnCloth> OneGrid(uint32_t side) {
    return {{.model = GridModel(side), .placement = {}, .colliders = {}}};
  }
  // The grid upright, filling the picture.
  static PictureSpec Close(Colouring colouring) {
    PictureSpec spec = SmallSpec();
    spec.camera = FrontCamera({0.5, 0.5, 0}, 10, 0.9);
    spec.colouring = colouring;
    return spec;
  }
};

TEST_F(ColouringTest, UniformStrainIsUniformAndInTheRightHue) {
  const std::vector<DrawnCloth> cloths = OneGrid(6);
  for (const double strain : {0.05, -0.05}) {
    const Map stretched = [&](const Vector3d& p) { return Vector3d((1 + strain) * Upright(p)); };
    const Picture picture = Draw(Close(Colouring::kStrain), cloths, HostStates(cloths, stretched));
    // Lengths of 0.2 m in single precision: 1e-7 of the strain's numerator.
    EXPECT_NEAR(picture.range.high, 0.05, 1e-6);
    EXPECT_NEAR(picture.range.low, -0.05, 1e-6);
    const Rgb middle = PixelOf(picture, 100, 100);
    EXPECT_EQ(Count(picture,
                    [&](size_t, size_t, const Rgb& pixel) { return Distance(pixel, middle) > 4; })
                  .count,
              0u);
    if (strain > 0) {
      EXPECT_GT(middle.red, 2 * middle.blue);
      EXPECT_GT(middle.red, 2 * middle.green);
    } else {
      EXPECT_GT(middle.blue, 2 * middle.red);
    }
  }
}

TEST_F(ColouringTest, TheLargestMagnitudeCountsWithItsSign) {
  const std::vector<DrawnCloth> cloths = OneGrid(6);
  // 2 % longer in one direction, 4 % shorter in the other.
  const Map sheared = [](const Vector3d& p) { return Vector3d(1.02 * p.x(), 0.96 * p.z(), 0); };
  const Picture picture = Draw(Close(Colouring::kStrain), cloths, HostStates(cloths, sheared));
  EXPECT_NEAR(picture.range.high, 0.04, 1e-6);
  const Rgb middle = PixelOf(picture, 100, 100);
  EXPECT_GT(middle.blue, 2 * middle.red);
}

TEST_F(ColouringTest, RestIsPale) {
  const std::vector<DrawnCloth> cloths = OneGrid(6);
  const Picture picture = Draw(Close(Colouring::kStrain), cloths, HostStates(cloths, Upright));
  EXPECT_EQ(picture.range.high, 1e-4);
  const Rgb middle = PixelOf(picture, 100, 100);
  EXPECT_LT(std::abs(middle.red - middle.blue), 25);
  EXPECT_GT(middle.green, 150);
}

TEST_F(ColouringTest, SpeedsHaveTheirRange) {
  const std::vector<DrawnCloth> cloths = OneGrid(6);
  const DrawnStates states =
      HostStates(cloths, Upright, [](const Vector3d& p) { return -(1 + 2 * p.x()); });
  PictureSpec spec = Close(Colouring::kSpeed);
  Picture picture = Draw(spec, cloths, states);
  EXPECT_NEAR(picture.range.low, 1, 1e-6);
  EXPECT_NEAR(picture.range.high, 3, 1e-6);
  // From dark violet to yellow.
  const Rgb slow = PixelOf(picture, 2, 100);
  const Rgb fast = PixelOf(picture, 197, 100);
  EXPECT_LT(slow.green, 60);
  EXPECT_GT(slow.blue, slow.green);
  EXPECT_GT(fast.green, 150);
  EXPECT_GT(fast.red, 2 * fast.blue);
  // Values beyond the ends of a given range have the colours of the ends.
  spec.range = {{10, 20}};
  picture = Draw(spec, cloths, states);
  EXPECT_EQ(picture.range.low, 10);
  EXPECT_EQ(picture.range.high, 20);
  EXPECT_LE(Distance(PixelOf(picture, 2, 100), PixelOf(picture, 197, 100)), 4);
}

// Vectors in place of velocities: the scale begins at 0, and its title is another.
TEST_F(ColouringTest, ContactsAreShownFromNone) {
  const std::vector<DrawnCloth> cloths = OneGrid(6);
  const DrawnStates states =
      HostStates(cloths, Upright, [](const Vector3d& p) { return 0.002 + 0.004 * p.x(); });
  PictureSpec spec = Close(Colouring::kContact);
  const Picture picture = Draw(spec, cloths, states);
  EXPECT_EQ(picture.range.low, 0);
  EXPECT_NEAR(picture.range.high, 0.006, 1e-8);
  EXPECT_GT(PixelOf(picture, 197, 100).green, PixelOf(picture, 2, 100).green + 60);
  spec = SmallSpec(480, 360);
  spec.camera = FrontCamera({0.5, 0.5, 0}, 10, 2);
  spec.range = picture.range;
  spec.colouring = Colouring::kSpeed;
  const Picture speeds = Draw(spec, cloths, states);
  spec.colouring = Colouring::kContact;
  EXPECT_GT(Difference(speeds, Draw(spec, cloths, states), 2).count, 0u) << "the same legend";
}

int SrgbByte(float linear) {
  const double srgb =
      linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
  return static_cast<int>(std::lround(255 * srgb));
}

TEST_F(ColouringTest, EachGroupHasItsColour) {
  const std::vector<DrawnCloth> cloths = OneGrid(6);
  PictureSpec spec = Close(Colouring::kColourGroup);
  const Picture picture = Draw(spec, cloths, HostStates(cloths, Upright));
  const uint32_t groups = cloths[0].model->colour_count();
  ASSERT_GE(groups, 4u);
  const auto pixels_of = [&](uint32_t group) {
    const shader::vec4 colour = GroupColour(group);
    const Rgb wanted{SrgbByte(colour.x), SrgbByte(colour.y), SrgbByte(colour.z)};
    return Count(picture,
                 [&](size_t, size_t, const Rgb& pixel) { return Distance(pixel, wanted) <= 3; })
        .count;
  };
  for (uint32_t group = 0; group < groups; ++group) {
    // At least two constraints, each 40 px long and more than 2 px wide inside its edges.
    EXPECT_GT(pixels_of(group), 80u) << group;
  }
  EXPECT_EQ(pixels_of(groups), 0u);
}

TEST_F(ColouringTest, LegendsAreShownUnlessHidden) {
  const std::vector<DrawnCloth> cloths = OneGrid(6);
  const DrawnStates states = HostStates(cloths, Upright, [](const Vector3d&) { return 1.0; });
  for (const Colouring colouring :
       {Colouring::kMaterial, Colouring::kStrain, Colouring::kColourGroup, Colouring::kSpeed,
        Colouring::kContact}) {
    PictureSpec spec = SmallSpec(480, 360);
    spec.camera = FrontCamera({0.5, 0.5, 0}, 10, 2);
    spec.colouring = colouring;
    const Picture with = Draw(spec, cloths, states);
    spec.has_legend = false;
    const Picture without = Draw(spec, cloths, states);
    const Patch legend = Difference(with, without, 2);
    if (colouring == Colouring::kMaterial) {
      EXPECT_EQ(legend.count, 0u);
      continue;
    }
    EXPECT_GT(legend.count, 1000u);
    EXPECT_GT(legend.centroid.x(), 400);
    // Text: dark on the panel.
    EXPECT_GT(Count(with,
                    [&](size_t x, size_t, const Rgb& pixel) {
                      return x > 380 && pixel.red < 130 &&
                             Distance(pixel, {pixel.red, pixel.red, pixel.red}) < 40;
                    })
                  .count,
              60u);
  }
}

// The camera of a picture with a legend leaves room for it.
TEST_F(ColouringTest, ClothsStayBesideTheLegend) {
  const std::vector<DrawnCloth> cloths = OneGrid(6);
  PictureSpec spec = SmallSpec(480, 360);
  spec.view_direction = {0, 0, -1};
  spec.colouring = Colouring::kStrain;
  const Map wide = [](const Vector3d& p) { return Vector3d(3 * p.x(), p.z(), 0); };
  const Picture picture = Draw(spec, cloths, HostStates(cloths, wide));
  const Patch red = Count(picture, [](size_t, size_t y, const Rgb& pixel) {
    return y > 200 && pixel.red > 2 * pixel.blue;  // below the legend
  });
  ASSERT_GT(red.count, 1000u);
  EXPECT_LT(red.centroid.x(), 230);
}

}  // namespace
}  // namespace drape::render
