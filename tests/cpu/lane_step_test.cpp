#include "server/solver/cpu/side_by_side/group_step.h"

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace drape::cpu {
namespace {

ClothParameters OnPlanes(size_t count) {
  ClothParameters parameters = test::PlainParameters();
  for (size_t k = 0; k < count; ++k) {
    parameters.colliders.push_back(PlaneThrough({0, -1, 0}, Eigen::Vector3d::UnitY()));
  }
  return parameters;
}

bool Fits(const FloatModel& model, const ClothParameters& parameters) {
  return FitsLanes(model, FloatControls(model, parameters, false));
}

// A thread's working memory for lanes stays within a few hundred megabytes, whatever a client
// sends.
TEST(FitsLanesTest, LargeClothsGoAlone) {
  const FloatModel most(test::SizedCloth(kMaxLaneParticles).model);
  constexpr size_t kMostPlanes = kMaxLaneContacts / kMaxLaneParticles;
  EXPECT_TRUE(Fits(most, OnPlanes(kMostPlanes)));
  EXPECT_FALSE(Fits(most, OnPlanes(kMostPlanes + 1)));
  const FloatModel larger(test::SizedCloth(kMaxLaneParticles + 256).model);
  EXPECT_FALSE(Fits(larger, OnPlanes(0)));
}

}  // namespace
}  // namespace drape::cpu
