#include "server/solver/bodies/convex_solid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>

#include "server/scene/distance_map.h"
#include "server/solver/bodies/body_points.h"

namespace drape::bodies {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A cylinder or capsule that is steeper than this touches with an end, else with a side [-], the
// cosine of the angle: 45 degrees, where both are as far from lying flat.
constexpr double kSteepCosine = 0.70710678118654752;
// Corners that are less than this nearer than the farthest one are as far [-], of the reach.
constexpr double kAsFar = 1e-9;

ConvexSolid Along(const Vector3d& a_m, const Vector3d& b_m, double disc_m, double round_m) {
  ConvexSolid solid{.centre_m = (a_m + b_m) / 2,
                    .axes = Matrix3d::Identity(),
                    .half_extents_m = Vector3d((b_m - a_m).stableNorm() / 2, 0, 0),
                    .disc_m = disc_m,
                    .round_m = round_m};
  if (a_m != b_m) {
    solid.axes.col(0) = (b_m - a_m).stableNormalized();
    solid.axes.col(1) = NormalOnSegment(b_m - a_m);
    solid.axes.col(2) = solid.axes.col(0).cross(solid.axes.col(1));
  }
  return solid;
}

std::optional<ConvexSolid> Unmoved(const BoxShape& box) {
  return ConvexSolid{.centre_m = Vector3d::Zero(),
                     .axes = Matrix3d::Identity(),
                     .half_extents_m = box.half_extents_m};
}
std::optional<ConvexSolid> Unmoved(const CylinderShape& cylinder) {
  return Along(cylinder.a_m, cylinder.b_m, cylinder.radius_m, 0);
}
std::optional<ConvexSolid> Unmoved(const CapsuleShape& capsule) {
  return Along(capsule.a_m, capsule.b_m, 0, capsule.radius_m);
}
std::optional<ConvexSolid> Unmoved(const DistanceMapShape& solid) {
  if (!solid.map->polytope()) return std::nullopt;
  ConvexSolid convex{.centre_m = solid.map->moments().centroid_m,
                     .axes = Matrix3d::Identity(),
                     .half_extents_m = Vector3d::Zero(),
                     .polytope = solid.map->polytope(),
                     .middle_m = solid.map->moments().centroid_m};
  for (const Vector3d& corner : convex.polytope->corners_m) {
    const Vector3d from_middle = (corner - convex.middle_m).cwiseAbs();
    convex.half_extents_m = convex.half_extents_m.cwiseMax(from_middle);
  }
  return convex;
}
template <class Other>
std::optional<ConvexSolid> Unmoved(const Other&) {
  return std::nullopt;
}

}  // namespace

std::optional<ConvexSolid> ConvexSolid::Of(const Collider& collider) {
  auto solid = std::visit([](const auto& shape) { return Unmoved(shape); }, collider.shape);
  if (solid) {
    solid->centre_m = collider.pose * solid->centre_m;
    solid->axes = collider.pose.rotation * solid->axes;
  }
  return solid;
}

ConvexSolid ConvexSolid::At(const RigidMotion& pose) const {
  ConvexSolid moved = *this;
  moved.centre_m = pose.PlaceOf(centre_m);
  moved.axes = pose.rotation * axes;
  return moved;
}

double ConvexSolid::ReachAlong(const Vector3d& n) const {
  const Vector3d shares = axes.transpose() * n;
  if (polytope) {
    double farthest = -std::numeric_limits<double>::infinity();
    for (const Vector3d& corner : polytope->corners_m) {
      farthest = std::max(farthest, shares.dot(corner - middle_m));
    }
    return farthest;
  }
  return shares.cwiseAbs().dot(half_extents_m) + disc_m * shares.tail<2>().norm() + round_m;
}

size_t ConvexSolid::face_count() const {
  if (polytope) return polytope->faces.size();
  return is_round() ? (disc_m > 0 ? 1 : 0) : 3;
}

Vector3d ConvexSolid::FaceNormal(size_t face) const {
  if (polytope) return axes * polytope->faces[face].normal;
  return axes.col(static_cast<Eigen::Index>(face));
}

size_t ConvexSolid::edge_count() const {
  if (polytope) return polytope->edge_directions.size();
  return is_round() ? 1 : 3;
}

Vector3d ConvexSolid::EdgeDirection(size_t edge) const {
  if (polytope) return axes * polytope->edge_directions[edge];
  return axes.col(static_cast<Eigen::Index>(edge));
}

size_t ConvexSolid::most_corners() const {
  if (!polytope) return is_round() ? (disc_m > 0 ? kRimPoints : 2) : 4;
  size_t most = 0;
  for (const auto& face : polytope->faces) most = std::max(most, face.corners.size());
  return most;
}

// Of the faces that have most of the farthest corners the one that is least tilted: a face that is
// less tilted need not reach as far.
Outline ConvexSolid::FaceTowards(const Vector3d& along_axes) const {
  const auto reach_of = [&](uint32_t corner) {
    return along_axes.dot(polytope->corners_m[corner] - middle_m);
  };
  double farthest = -std::numeric_limits<double>::infinity();
  for (uint32_t c = 0; c < polytope->corners_m.size(); ++c) {
    farthest = std::max(farthest, reach_of(c));
  }
  const double far_enough = farthest - kAsFar * half_extents_m.sum();
  std::pair<std::ptrdiff_t, double> best{-1, 0};
  Outline outline;
  for (size_t f = 0; f < polytope->faces.size(); ++f) {
    const auto& face = polytope->faces[f];
    const std::pair key{
        std::ranges::count_if(face.corners, [&](uint32_t c) { return reach_of(c) >= far_enough; }),
        along_axes.dot(face.normal)};
    if (key <= best) continue;
    best = key;
    outline.part = static_cast<int>(f);
  }
  for (const uint32_t c : polytope->faces[static_cast<size_t>(outline.part)].corners) {
    outline.corners_m.push_back(centre_m + axes * (polytope->corners_m[c] - middle_m));
  }
  return outline;
}

Outline ConvexSolid::OutlineTowards(const Vector3d& n) const {
  const Vector3d shares = axes.transpose() * n;
  if (polytope) return FaceTowards(shares);
  Outline outline{.corners_m = {}, .round_m = round_m};
  const auto add = [&](const Vector3d& along_axes) {
    outline.corners_m.push_back(centre_m + axes * along_axes);
  };
  Eigen::Index up = 0;
  if (!is_round()) shares.cwiseAbs().maxCoeff(&up);
  const double side = shares[up] < 0 ? -1 : 1;
  outline.part = static_cast<int>(2 * up + (side > 0 ? 1 : 0));
  if (!is_round()) {
    const Eigen::Index u = (up + 1) % 3, v = (up + 2) % 3;
    for (const auto& [s, t] : {std::pair{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}) {
      Vector3d corner;
      corner[up] = side * half_extents_m[up];
      corner[u] = s * half_extents_m[u];
      corner[v] = t * half_extents_m[v];
      add(corner);
    }
    return outline;
  }
  const Vector3d end(side * half_extents_m.x(), 0, 0);
  const bool is_steep = std::abs(shares.x()) > kSteepCosine;
  if (is_steep && disc_m > 0) {
    const Rim rim{.centre_m = centre_m + axes * end,
                  .axis = axes.col(0),
                  .side = axes.col(1),
                  .radius_m = disc_m};
    rim.AddPlaces(n, outline.corners_m);
  } else if (is_steep || half_extents_m.x() == 0) {
    add(end);
  } else {
    outline.part = 2;
    const Vector3d out = disc_m / shares.tail<2>().norm() * Vector3d(0, shares.y(), shares.z());
    add(end + out);
    add(out - end);
  }
  return outline;
}

}  // namespace drape::bodies
