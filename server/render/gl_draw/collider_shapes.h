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

// All points within a radius of a box: a sphere (the box is a point), a capsule (a segment along
// the second axis) or a cuboid (radius 0); or a mesh with its bounding box. World frame.
struct DrawnSolid {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // of the box, unit, as columns
  Eigen::Vector3d half_extents_m = Eigen::Vector3d::Zero();
  double radius_m = 0;
  // Drawn smaller, so that cloth that lies on it is visible.
  Eigen::Vector3d drawn_half_extents_m = Eigen::Vector3d::Zero();
  double drawn_radius_m = 0;
  std::shared_ptr<const TriangleMesh> mesh{};               // null: no mesh
  Eigen::Vector3d mesh_scale = Eigen::Vector3d::Ones();     // of the mesh along its axes
  Eigen::Vector3d mesh_center_m = Eigen::Vector3d::Zero();  // of its box, in the mesh's frame
  double inset_m = 0;  // for a mesh: depth below its surface at which it is drawn
};
struct DrawnPlane {
  Eigen::Vector3d point_m;
  Eigen::Vector3d normal;  // unit
};
struct ColliderShapes {
  std::vector<DrawnSolid> solids;
  std::vector<DrawnPlane> planes;
};

// The colliders of all cloths, each once (cloths of one environment share them).
//
// The particles of a cloth lie on the surface, but the edges between them pass below it. On a
// sphere or capsule the middle of an edge of length l is l^2 / (8 R) inside. The radius is reduced
// by that, for the diagonals of squares of the model's mean rest length (twice l^2) stretched by a
// fifth, plus 0.4 % of R, but at most by a quarter of R. Edges of the cloth cut the corners of a
// box: boxes are reduced by a fifth of the mean rest length plus 0.4 %, at most by a quarter.
// A cylinder is reduced like a sphere around its axis and like a box at its ends. Meshes are
// reduced by 0.3 of the mean rest length, at most by a cell of their map.
ColliderShapes CollectColliders(std::span<const DrawnCloth> cloths);

// Half sizes of the box; all equal for a sphere.
std::array<Eigen::Vector3d, 8> CornersOf(const DrawnSolid& solid);

// Whether a fitted camera should show the solid too: it is not much larger than `bounds_m` and
// within half their diagonal. Other solids (a ground, something distant) must not shrink the
// cloths.
bool IsNear(const DrawnSolid& solid, const Eigen::AlignedBox3d& bounds_m);

}  // namespace drape::render
