// What ties a rigid body to another collider or to the environment. Pure.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace drape {

// A point joint: a point of the body stays at one of the other side. Or a rope between two points,
// which pulls and does not push. Points are those of the colliders as described, in their frame.
struct BodyJoint {
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();
  std::optional<uint32_t> collider;  // the other side, not the body's own; unset: the environment
  Eigen::Vector3d other_point_m = Eigen::Vector3d::Zero();  // of the other side; of a point joint
                                                            // the same as point_m
  std::optional<double> rope_length_m;                      // > 0; unset: a point joint
  std::vector<Eigen::Vector3d> pulleys_m;  // points of the environment along a rope, from point_m

  bool is_rope() const { return rope_length_m.has_value(); }

  bool operator==(const BodyJoint&) const = default;
};

// The way of a rope between its ends `end_m` and `other_end_m` [m].
double RopeWay_m(const BodyJoint& rope, const Eigen::Vector3d& end_m,
                 const Eigen::Vector3d& other_end_m);

}  // namespace drape
