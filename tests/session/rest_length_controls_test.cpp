#include "server/session/rest_length_controls.h"

#include <gtest/gtest.h>

#include <ctime>

#include "tests/session/session_fixture.h"

namespace drape {
namespace {

class RestLengthControlsTest : public SessionFixture {
 protected:
  RestLengthControlsTest() {
    Start();
    cloths_ = Find(Create(Chains(2, 3, {{0, std::nullopt}, {1, std::nullopt}})).value().ids);
  }
  ClothList cloths_;
};

TEST_F(RestLengthControlsTest, RowsFindTheirCloths) {
  const std::vector<RestLengthRow> rows{{cloths_[1]->id, 1, 0.75, 0.5}};
  const auto controls = MapLengthControls(rows, cloths_).value();
  ASSERT_EQ(controls.size(), 1u);
  EXPECT_EQ(controls[0].cloth_index, 1u);
  EXPECT_EQ(controls[0].constraint, 1u);
  EXPECT_EQ(controls[0].length_m, 0.75);
  EXPECT_EQ(controls[0].over_s, 0.5);
  const std::vector<RestLengthScaleRow> scales{{cloths_[1]->id, 2, 0.25}};
  EXPECT_EQ(MapLengthScales(scales, cloths_).value()[0].cloth_index, 1u);
}

TEST_F(RestLengthControlsTest, BadRowsAreNamed) {
  const std::vector<RestLengthRow> rows{{cloths_[0]->id, 1, 1, 0},
                                        {{99, 1}, 0, 1, 0},
                                        {cloths_[0]->id, 0, 1, 0},   // between two pins
                                        {cloths_[0]->id, 2, 1, 0}};  // there are two
  const Status status = MapLengthControls(rows, cloths_).status();
  ASSERT_EQ(status.violations().size(), 3u);
  EXPECT_EQ(status.violations()[0].field, "rest_length_controls.cloth_ids[1]");
  EXPECT_EQ(status.violations()[1].field, "rest_length_controls.constraints[2]");
  EXPECT_NE(status.violations()[1].description.find("two pins"), std::string::npos);
  EXPECT_EQ(status.violations()[2].field, "rest_length_controls.constraints[3]");

  const std::vector<RestLengthScaleRow> scales{
      {{99, 1}, 2, 0}, {cloths_[0]->id, 1e-10, 0}, {cloths_[0]->id, 2, 0}};
  const Status scaled = MapLengthScales(scales, cloths_).status();
  ASSERT_EQ(scaled.violations().size(), 3u);
  EXPECT_EQ(scaled.violations()[0].field, "rest_length_scales.cloth_ids[0]");
  EXPECT_EQ(scaled.violations()[1].field, "rest_length_scales.scales[1]");
  EXPECT_EQ(scaled.violations()[2].field, "rest_length_scales.cloth_ids[2]");
  EXPECT_NE(scaled.violations()[2].description.find("occurs twice"), std::string::npos);
}

// Clients may drive every constraint of a large cloth. A search per row would be 2e10 comparisons,
// tens of seconds; this takes about as long as to make the rows.
TEST_F(RestLengthControlsTest, ManyRowsTakeTimeInProportion) {
  constexpr uint32_t kLinks = 200'000;
  const ClothList chain = Find(Create(Chains(1, kLinks + 1)).value().ids);
  std::vector<RestLengthRow> rows;
  for (uint32_t k = 0; k < kLinks; ++k) rows.push_back({chain[0]->id, k, 1, 0});
  const std::clock_t begin = std::clock();
  EXPECT_EQ(MapLengthControls(rows, chain).value().size(), kLinks);
  EXPECT_LT(std::clock() - begin, 3 * CLOCKS_PER_SEC);
}

}  // namespace
}  // namespace drape
