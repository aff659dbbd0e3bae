#include "server/solver/cloth_start.h"

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

// Up is against gravity; without gravity it is +y.
TEST(ClothStart, LeavesAgainstGravity) {
  Scene sheet = Grid(12, 12, 1, 1);
  const Vector3d middle_m = sheet.state.positions_m[65];
  sheet.parameters.colliders = {SphereAt(middle_m, 0.3)};
  const auto height_m = [&](const Vector3d& gravity_m_per_s2) {
    sheet.parameters.gravity_m_per_s2 = gravity_m_per_s2;
    const ClearStart start =
        FindClearStart(*sheet.model, sheet.parameters, sheet.state.positions_m);
    EXPECT_EQ(start.clearance, StartClearance::kCleared);
    return start.positions_m.empty() ? 0 : start.positions_m[65].y();
  };
  EXPECT_GT(height_m({0, -9.81, 0}), 0.2);
  EXPECT_GT(height_m({0, 0, 0}), 0.2);
  EXPECT_LT(height_m({0, 9.81, 0}), -0.2);
}

// A collider counts at the start of its motion, not where it is described.
TEST(ClothStart, CollidersAreWhereTheirMotionsBegin) {
  Scene sheet = Grid(12, 12, 1, 1);
  const Vector3d middle_m = sheet.state.positions_m[65];
  const auto clearance = [&](const Vector3d& described_m, const Vector3d& begins_m) {
    sheet.parameters.colliders = {SphereAt(described_m, 0.3)};
    RigidMotion motion = RigidMotion::AtRest(described_m);
    motion.position_m = begins_m;
    motion.velocity_m_per_s = Vector3d(0, 1, 0);
    sheet.parameters.collider_motions = {motion};
    return FindClearStart(*sheet.model, sheet.parameters, sheet.state.positions_m).clearance;
  };
  EXPECT_EQ(clearance(middle_m, Vector3d(0, 5, 0)), StartClearance::kFree);
  EXPECT_EQ(clearance(Vector3d(0, 5, 0), middle_m), StartClearance::kCleared);
}

}  // namespace
}  // namespace drape::test
