// Boxes, cylinders, capsules and convex meshes of few faces: how far they reach along a direction,
// and with what part of their surface they touch there. Pure.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "server/scene/colliders.h"
#include "server/scene/convex_polytope.h"
#include "server/scene/rigid_motion.h"

namespace drape::bodies {

// What a solid touches a plane with: a point, the ends of a line, or the corners of a face, in
// turn. The surface is `round_m` farther than they are, towards the plane.
struct Outline {
  std::vector<Eigen::Vector3d> corners_m;
  double round_m = 0;
  int part = 0;  // which one of the solid's: tells whether two outlines are of the same
};

// A cuboid; a segment (along the first axis) that is widened by a disc across it, or by a ball; or
// a polytope.
struct ConvexSolid {
  Eigen::Vector3d centre_m;  // a place inside
  Eigen::Matrix3d axes;      // columns, orthonormal
  Eigen::Vector3d
      half_extents_m;  // of a segment the first alone is not 0; of its box of a polytope
  double disc_m = 0;   // radius
  double round_m = 0;  // radius
  std::shared_ptr<const ConvexPolytope> polytope{};    // about the centre, along the axes
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  // of a polytope: what its centre is there

  // As described. None of a sphere, which one point tells all of, of a plane and of other meshes.
  static std::optional<ConvexSolid> Of(const Collider& collider);

  bool is_round() const { return disc_m > 0 || round_m > 0; }
  ConvexSolid At(const RigidMotion& pose) const;
  // The farthest from the centre along the unit vector n [m].
  double ReachAlong(const Eigen::Vector3d& n) const;
  // Normals of flat faces; of a box and a cylinder one of two opposite ones.
  size_t face_count() const;
  Eigen::Vector3d FaceNormal(size_t face) const;
  // Directions of straight edges, and of the lines of cylinders and capsules along their axes.
  size_t edge_count() const;
  Eigen::Vector3d EdgeDirection(size_t edge) const;
  size_t most_corners() const;  // of an outline
  // What lies farthest along the unit vector n: of a tilted face or line more than its farthest
  // point, so that what stands on it is held from falling over at once.
  Outline OutlineTowards(const Eigen::Vector3d& n) const;

 private:
  Outline FaceTowards(const Eigen::Vector3d& along_axes) const;
};

}  // namespace drape::bodies
