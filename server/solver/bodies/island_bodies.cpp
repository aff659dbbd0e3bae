#include "server/solver/bodies/island_bodies.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace drape::bodies {

using Eigen::Matrix3d;
using Eigen::Vector3d;

void IslandBodies::AddSide(ProblemSides& its, size_t c, const Vector3d& arm_m,
                           const Matrix3d& push) {
  if (!placed_[c].body) return;
  const RigidBody& body = *placed_[c].body;
  const auto index = static_cast<size_t>(std::ranges::find(colliders_, c) - colliders_.begin());
  if (index == colliders_.size()) {
    colliders_.push_back(c);
    const Matrix3d inverse = when_ == When::kShift ? body.InverseInertiaAt(placed_[c].end.rotation)
                                                   : body.inverse_inertia();
    roots_.push_back(inverse.llt().matrixL());
  }
  its.sides[its.side_count++] = {
      index, push.transpose() * MobilityOf(body.mass_kg(), roots_[index], arm_m)};
}

ProblemSides IslandBodies::SidesOf(const BodyJoints::Joint& joint) {
  ProblemSides sides;
  for (const BodyJoints::End& end : joint.ends) {
    if (end.collider) AddSide(sides, *end.collider, end.arm_m, end.push);
  }
  return sides;
}

}  // namespace drape::bodies
