// Points by which a solid is tried against the surfaces of others. Pure.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "server/scene/colliders.h"

namespace drape::bodies {

// The solid touches what is nearer to one of the points than the radius.
struct BodyPoints {
  std::vector<Eigen::Vector3d> places_m;  // as described
  double radius_m = 0;
};

// A sphere's centre, the ends of a capsule, the corners of a box, kRimPoints around each end of a
// cylinder, the outermost vertices of a mesh; none of a plane. Edges between them are not seen: two
// boxes that cross edge over edge sink into each other until a corner meets.
BodyPoints PointsOf(const Collider& collider);

// More: rounder rims; each is tried in every sweep [-].
inline constexpr int kRimPoints = 16;

}  // namespace drape::bodies
