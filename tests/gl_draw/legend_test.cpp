#include "server/render/gl_draw/legend.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "shaders/interface/draw_bindings.h"

namespace drape::render {
namespace {

using testing::ElementsAre;

std::vector<std::string> Labels(double low, double high) {
  std::vector<std::string> labels;
  for (const Tick& tick : RoundTicks(low, high)) labels.push_back(tick.label);
  return labels;
}

TEST(LegendTest, TicksAreRound) {
  EXPECT_THAT(Labels(0, 1), ElementsAre("0.00", "0.25", "0.50", "0.75", "1.00"));
  EXPECT_THAT(Labels(-5.9, 5.9), ElementsAre("-4", "-2", "0", "2", "4"));
  EXPECT_THAT(Labels(3.02, 3.11), ElementsAre("3.02", "3.04", "3.06", "3.08", "3.10"));
  EXPECT_THAT(Labels(0, 2e6), ElementsAre("0", "5e+05", "1e+06", "1.5e+06", "2e+06"));
  EXPECT_THAT(Labels(0, 7e-6), ElementsAre("0", "2e-06", "4e-06", "6e-06"));
}

TEST(LegendTest, TicksAreFewInsideAndEven) {
  for (int k = -60; k < 60; ++k) {
    const double low = std::sin(k) * std::pow(10, k % 7);
    const double high = low + std::pow(1.37, k);
    const std::vector<Tick> ticks = RoundTicks(low, high);
    ASSERT_GE(ticks.size(), 2u) << low << " " << high;
    ASSERT_LE(ticks.size(), 5u) << low << " " << high;
    const double span = high - low;
    EXPECT_GE(ticks.front().value, low - 1e-5 * span);
    EXPECT_LE(ticks.back().value, high + 1e-5 * span);
    for (size_t i = 2; i < ticks.size(); ++i) {
      EXPECT_NEAR(ticks[i].value - ticks[i - 1].value, ticks[1].value - ticks[0].value,
                  1e-9 * (span + std::abs(low)));
    }
  }
}

class LegendLayoutTest : public testing::Test {
 protected:
  std::vector<shader::LabelRecord> LayOut(Colouring colouring, uint32_t group_count = 0) const {
    PictureSpec spec;
    spec.colouring = colouring;
    return LayOutLegend(spec, {-0.02, 0.02}, group_count, glyphs_);
  }
  static size_t CountOf(const std::vector<shader::LabelRecord>& labels, uint32_t kind) {
    return static_cast<size_t>(
        std::count_if(labels.begin(), labels.end(),
                      [kind](const shader::LabelRecord& label) { return label.kind == kind; }));
  }

  GlyphAtlas glyphs_ = GlyphAtlas::Bake(15);
};

TEST_F(LegendLayoutTest, EverythingIsInsideThePanelAndThePanelInThePicture) {
  for (const auto& [colouring, groups] :
       {std::pair(Colouring::kStrain, 0u), std::pair(Colouring::kSpeed, 0u),
        std::pair(Colouring::kColourGroup, 3u), std::pair(Colouring::kColourGroup, 500u)}) {
    const std::vector<shader::LabelRecord> labels = LayOut(colouring, groups);
    ASSERT_FALSE(labels.empty());
    const shader::vec4& panel = labels[0].box;
    EXPECT_GE(panel.x, 0);
    EXPECT_GE(panel.y, 0);
    EXPECT_LE(panel.z, 960);
    EXPECT_LE(panel.w, 720);
    for (const shader::LabelRecord& label : labels) {
      EXPECT_GE(label.box.x, panel.x);
      EXPECT_GE(label.box.y, panel.y);
      EXPECT_LE(label.box.z, panel.z);
      EXPECT_LE(label.box.w, panel.w);
    }
    PictureSpec spec;
    EXPECT_LE(960 - panel.x, LegendWidth(spec) + 20);
  }
}

TEST_F(LegendLayoutTest, ScalesAndSwatches) {
  EXPECT_TRUE(LayOut(Colouring::kMaterial).empty());
  EXPECT_TRUE(LayOut(Colouring::kColourGroup, 0).empty());
  EXPECT_EQ(CountOf(LayOut(Colouring::kStrain), DRAPE_DRAW_LABEL_STRAIN_SCALE), 1u);
  EXPECT_EQ(CountOf(LayOut(Colouring::kSpeed), DRAPE_DRAW_LABEL_SPEED_SCALE), 1u);
  // The panel, and a swatch for each of the groups up to 16.
  EXPECT_EQ(CountOf(LayOut(Colouring::kColourGroup, 3), DRAPE_DRAW_LABEL_PANEL), 4u);
  const auto many = LayOut(Colouring::kColourGroup, 40);
  EXPECT_EQ(CountOf(many, DRAPE_DRAW_LABEL_PANEL), 17u);
  // "colour group", the numbers 0 to 15, "+24 more"; blanks are glyphs as well.
  EXPECT_EQ(CountOf(many, DRAPE_DRAW_LABEL_GLYPH), 12u + 10 + 12 + 8);
}

TEST_F(LegendLayoutTest, APictureTooSmallHasNone) {
  PictureSpec spec;
  spec.width_px = 60;
  spec.height_px = 600;
  spec.colouring = Colouring::kStrain;
  EXPECT_TRUE(LayOutLegend(spec, {-1, 1}, 0, glyphs_).empty());
  EXPECT_EQ(LegendTextSize(319, 4000), 0u);
  EXPECT_EQ(LegendTextSize(16, 16), 0u);
  EXPECT_EQ(LegendTextSize(960, 720), 15u);
  EXPECT_EQ(LegendTextSize(1920, 1440), 30u);
}

}  // namespace
}  // namespace drape::render
