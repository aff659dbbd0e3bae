#include "server/session/pin_controls.h"

#include <gtest/gtest.h>

#include "tests/session/session_fixture.h"

namespace drape {
namespace {

class PinControlsTest : public SessionFixture {
 protected:
  PinControlsTest() {
    Start();
    ClothCreation creation = Chains(2, 3, {{0, std::nullopt}, {2, std::nullopt}});
    creation.copies[1].transform.position_m = {0, 5, 0};
    cloths_ = Find(Create(creation).value().ids);
  }
  ClothList cloths_;
};

TEST_F(PinControlsTest, TargetsAreBroughtIntoTheClothsFrame) {
  const std::vector<PinControlRow> rows{{cloths_[1]->id, 2, {1, 6, 0}, 0.5},
                                        {cloths_[0]->id, 0, {1, 6, 0}, 0}};
  const auto controls = MapPinControls(rows, cloths_).value();
  ASSERT_EQ(controls.size(), 2u);
  EXPECT_EQ(controls[0].cloth_index, 1u);
  EXPECT_EQ(controls[0].particle, 2u);
  EXPECT_EQ(controls[0].target_m, Eigen::Vector3d(0, 1, 0));  // the cloth's origin is (1, 5, 0)
  EXPECT_EQ(controls[0].over_s, 0.5);
  EXPECT_EQ(controls[1].target_m, Eigen::Vector3d(0, 6, 0));
}

TEST_F(PinControlsTest, BadRowsAreNamed) {
  const std::vector<PinControlRow> rows{
      {cloths_[0]->id, 0, {}, 0}, {{99, 1}, 0, {}, 0}, {cloths_[1]->id, 1, {}, 0}};
  const Status status = MapPinControls(rows, cloths_).status();
  ASSERT_EQ(status.violations().size(), 2u);
  EXPECT_EQ(status.violations()[0].field, "pin_controls.cloth_ids[1]");
  EXPECT_EQ(status.violations()[1].field, "pin_controls.particles[2]");
}

}  // namespace
}  // namespace drape
