// Colliders as they are drawn. Pure.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "server/render/picture_spec.h"

namespace drape::render {

// All points no farther than a radius from a box: a sphere (the box is a point), a capsule (a
// segment along the second axis) or a cuboid (radius 0); or the mesh of a distance map, which has
// the box around it. World frame.
struct DrawnSolid {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // of the box, unit, as columns
  Eigen::Vector3d half_extents_m = Eigen::Vector3d::Zero();
  double radius_m = 0;
  // Smaller, so that the cloth that lies on it is seen.
  Eigen::Vector3d drawn_half_extents_m = Eigen::Vector3d::Zero();
  double drawn_radius_m = 0;
  std::shared_ptr<const DistanceMap> map{};  // null: no mesh
  double inset_m = 0;                        // of a mesh: how far inside its surface it is drawn
};
struct DrawnPlane {
  Eigen::Vector3d point_m;
  Eigen::Vector3d normal;  // unit
};
struct ColliderShapes {
  std::vector<DrawnSolid> solids;
  std::vector<DrawnPlane> planes;
};

// Those of all cloths, each once (cloths of one environment have the same).
//
// The particles of a cloth lie on the surface. On a sphere or capsule the middle of an edge of
// length l is then l^2 / (8 R) inside it: the radius is drawn smaller by that, for the diagonals of
// squares of the model's mean rest length (twice l^2) stretched by a fifth, and by 0.4 % of R; by a
// quarter of R at most. Across the edge of a box an edge of the cloth takes a short cut: boxes are
// drawn smaller by a fifth of the mean rest length and 0.4 %, by a quarter at most; meshes by 0.3
// of the mean rest length, by a cell of their map at most.
ColliderShapes CollectColliders(std::span<const DrawnCloth> cloths);

// Of the grid, which is that of the mesh's box [m]; mesh frame.
Eigen::Vector3d CenterOf(const DistanceMap& map);

// Of the box; all the same for a sphere.
std::array<Eigen::Vector3d, 8> CornersOf(const DrawnSolid& solid);

// Whether a solid belongs to the picture of what is in `bounds_m`: it is not much larger and within
// half the diagonal of the bounds. Others (a ground, something far away) must not shrink the
// cloths.
bool IsNear(const DrawnSolid& solid, const Eigen::AlignedBox3d& bounds_m);

}  // namespace drape::render
