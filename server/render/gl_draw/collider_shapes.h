// Colliders as they are drawn. Pure.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "server/render/picture_spec.h"

namespace drape::render {

// World frame.
struct DrawnSphere {
  Eigen::Vector3d center_m;
  double radius_m = 0;        // of the collider
  double drawn_radius_m = 0;  // smaller, so that the cloth that lies on it is seen
};
struct DrawnPlane {
  Eigen::Vector3d point_m;
  Eigen::Vector3d normal;  // unit
};
struct ColliderShapes {
  std::vector<DrawnSphere> spheres;
  std::vector<DrawnPlane> planes;
};

// Those of all cloths, each once (cloths of one environment have the same).
//
// The particles of a cloth lie on the sphere, so the middle of an edge of length l is l^2 / (8 R)
// inside it. Spheres are drawn smaller by that, for the diagonals of squares of the model's mean
// rest length (twice l^2) stretched by a fifth, and by 0.4 % of R; by a quarter of R at most.
ColliderShapes CollectColliders(std::span<const DrawnCloth> cloths);

// Whether a sphere belongs to the picture of what is in `bounds_m`: it is not much larger and
// within half the diagonal of the bounds. Others (a ground, something far away) must not shrink the
// cloths.
bool IsNear(const DrawnSphere& sphere, const Eigen::AlignedBox3d& bounds_m);

}  // namespace drape::render
