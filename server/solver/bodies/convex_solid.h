// Boxes, cylinders and capsules as convex solids: how far they reach along a direction, and with
// what part of their surface they touch there. Pure.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "server/scene/colliders.h"
#include "server/scene/rigid_motion.h"

namespace drape::bodies {

// What a solid touches a plane with: a point, the ends of a line, or the corners of a face, in
// turn. The surface is `round_m` farther than they are, towards the plane.
struct Outline {
  std::vector<Eigen::Vector3d> corners_m;
  double round_m = 0;
  int part = 0;  // which one of the solid's: tells whether two outlines are of the same
};

// A cuboid, or a segment (along the first axis) that is widened by a disc across it, or by a ball.
struct ConvexSolid {
  Eigen::Vector3d centre_m;
  Eigen::Matrix3d axes;            // columns, orthonormal
  Eigen::Vector3d half_extents_m;  // of a segment the first alone is not 0
  double disc_m = 0;               // radius
  double round_m = 0;              // radius

  // As described. None of a sphere, which one point tells all of, of a plane and of a map.
  static std::optional<ConvexSolid> Of(const Collider& collider);

  bool is_box() const { return disc_m == 0 && round_m == 0; }
  ConvexSolid At(const RigidMotion& pose) const;
  // Half of the width along the unit vector n [m].
  double HalfWidthAlong(const Eigen::Vector3d& n) const;
  // Normals of flat faces, and directions of straight edges and of the lines of cylinders and
  // capsules along their axes: so many columns of `axes`.
  int face_count() const { return is_box() ? 3 : (disc_m > 0 ? 1 : 0); }
  int edge_count() const { return is_box() ? 3 : 1; }
  // What lies farthest along the unit vector n: of a tilted face or line more than its farthest
  // point, so that what stands on it is held from falling over at once.
  Outline OutlineTowards(const Eigen::Vector3d& n) const;
};

}  // namespace drape::bodies
