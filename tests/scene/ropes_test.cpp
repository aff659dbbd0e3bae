#include "server/scene/ropes.h"

#include <gtest/gtest.h>

namespace drape {
namespace {

// From the body's point by its pulleys to the other side, where these are now.
TEST(Ropes, AreDrawnPartByPart) {
  std::vector<Collider> colliders{SphereAt({0, 1, 0}, 0.1), SphereAt({2, 1, 0}, 0.1)};
  BodyJoint rope{.point_m = {0, 1.25, 0},
                 .collider = 1,
                 .other_point_m = {2, 1.25, 0},
                 .rope_length_m = 8,
                 .pulleys_m = {{0, 3, 0}, {2, 3, 0}}};
  colliders[0].joints = {rope, BodyJoint()};
  std::vector<RigidMotion> motions;
  for (const Collider& collider : colliders) {
    motions.push_back(RigidMotion::AtRest(CentreOf(collider)));
  }
  motions[0].position_m.y() -= 0.5;
  motions[1].position_m.y() += 0.5;
  const std::vector<Collider> parts = RopesOf(colliders, motions);
  ASSERT_EQ(parts.size(), 3u);  // nothing of the point joint
  const auto ends = [&](size_t k) { return std::get<CapsuleShape>(parts[k].shape); };
  EXPECT_EQ(ends(0).a_m, Eigen::Vector3d(0, 0.75, 0));
  EXPECT_EQ(ends(0).b_m, ends(1).a_m);
  EXPECT_EQ(ends(1).a_m, Eigen::Vector3d(0, 3, 0));
  EXPECT_EQ(ends(2).b_m, Eigen::Vector3d(2, 1.75, 0));
}

}  // namespace
}  // namespace drape
