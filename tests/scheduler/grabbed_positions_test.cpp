#include "server/scheduler/grabbed_positions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/scheduler/fake_backend.h"

namespace drape {
namespace {

using Eigen::Vector3d;
using testing::ElementsAre;
using Controls = std::vector<ClothControl<GripControl>>;

// Chains whose particles are at x = 0, 1, 2, ...
class GrabbedPositionsTest : public testing::Test {
 protected:
  std::vector<std::shared_ptr<ClothRuntime>> Chains(size_t count, uint32_t particles) {
    const auto model = ChainModel(particles, {0});
    std::vector<std::shared_ptr<ClothRuntime>> cloths;
    while (cloths.size() < count) cloths.push_back(BeginCloth(backend_, model));
    return cloths;
  }
  static ClothControl<GripControl> Particle(uint32_t cloth, uint32_t particle) {
    return {cloth, {.action = GripAction::kGrabParticle, .particle = particle}};
  }

  std::shared_ptr<FakeDevice> device_ = std::make_shared<FakeDevice>();
  FakeBackend backend_{device_};
};

// Grabbing one particle of each of many cloths reads that one, not all cloths.
TEST_F(GrabbedPositionsTest, OnlyWhatIsGrabbedIsRead) {
  auto cloths = Chains(3, 1000);
  cloths.push_back(Chains(1, 20)[0]);
  const Controls controls{Particle(0, 7),
                          Particle(1, 900),
                          Particle(2, 7),
                          Particle(3, 19),
                          {3, {.action = GripAction::kHold}}};
  const GrabbedPositions grabbed(backend_, controls, cloths);
  EXPECT_THAT(device_->reads(), testing::UnorderedElementsAre(3, 1));
  EXPECT_EQ(device_->position_rows_read(), 3 * 2 + 1u);
  EXPECT_EQ(grabbed.GrabbedBy(controls[1], *cloths[1]), 900u);
  EXPECT_EQ(grabbed.PositionOf(0, 7), Vector3d(7, 0, 0));
  EXPECT_EQ(grabbed.PositionOf(1, 900), Vector3d(900, 0, 0));
  EXPECT_EQ(grabbed.PositionOf(3, 19), Vector3d(19, 0, 0));
  EXPECT_EQ(grabbed.GrabbedBy(Particle(0, 0), *cloths[0]), std::nullopt) << "a pin";
}

TEST_F(GrabbedPositionsTest, WhereTheNearestIsSearchedTheClothIsRead) {
  const auto cloths = Chains(2, 100);
  const Controls controls{
      Particle(0, 7),
      {0, {.action = GripAction::kGrabNearest, .radius_m = 1, .place_m = {41.4, 0, 0}}},
      Particle(1, 8)};
  const GrabbedPositions grabbed(backend_, controls, cloths);
  EXPECT_EQ(device_->position_rows_read(), 100 + 1u);
  EXPECT_EQ(grabbed.GrabbedBy(controls[1], *cloths[0]), 41u);
  EXPECT_EQ(grabbed.PositionOf(0, 41), Vector3d(41, 0, 0));
  EXPECT_EQ(grabbed.PositionOf(0, 7), Vector3d(7, 0, 0));
  EXPECT_EQ(grabbed.PositionOf(1, 8), Vector3d(8, 0, 0));
}

// Neither a read for each cloth, nor all that any cloth wants from every cloth.
TEST_F(GrabbedPositionsTest, ClothsAreReadTogether) {
  const auto cloths = Chains(130, 200);
  Controls controls;
  for (uint32_t k = 0; k < 130; ++k) controls.push_back(Particle(k, k + 1));
  const GrabbedPositions grabbed(backend_, controls, cloths);
  EXPECT_THAT(device_->reads(), ElementsAre(64, 64, 2));
  EXPECT_EQ(device_->position_rows_read(), 64 * 64 + 64 * 64 + 2 * 2u);
  for (uint32_t k = 0; k < 130; ++k) EXPECT_EQ(grabbed.PositionOf(k, k + 1), Vector3d(k + 1, 0, 0));
}

}  // namespace
}  // namespace drape
