#include "server/session/rest_length_controls.h"

#include <gtest/gtest.h>

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

  const std::vector<RestLengthScaleRow> scales{{{99, 1}, 2, 0}, {cloths_[0]->id, 1e-10, 0}};
  const Status scaled = MapLengthScales(scales, cloths_).status();
  ASSERT_EQ(scaled.violations().size(), 2u);
  EXPECT_EQ(scaled.violations()[0].field, "rest_length_scales.cloth_ids[0]");
  EXPECT_EQ(scaled.violations()[1].field, "rest_length_scales.scales[1]");
}

}  // namespace
}  // namespace drape
