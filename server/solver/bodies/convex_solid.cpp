#include "server/solver/bodies/convex_solid.h"

#include <cmath>
#include <variant>

#include "server/solver/bodies/body_points.h"

namespace drape::bodies {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A cylinder or capsule that is steeper than this touches with an end, else with a side [-], the
// cosine of the angle: 45 degrees, where both are as far from lying flat.
constexpr double kSteepCosine = 0.70710678118654752;

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

double ConvexSolid::HalfWidthAlong(const Vector3d& n) const {
  const Vector3d shares = axes.transpose() * n;
  return shares.cwiseAbs().dot(half_extents_m) + disc_m * shares.tail<2>().norm() + round_m;
}

Outline ConvexSolid::OutlineTowards(const Vector3d& n) const {
  const Vector3d shares = axes.transpose() * n;
  Outline outline{.corners_m = {}, .round_m = round_m};
  const auto add = [&](const Vector3d& along_axes) {
    outline.corners_m.push_back(centre_m + axes * along_axes);
  };
  Eigen::Index up = 0;
  if (is_box()) shares.cwiseAbs().maxCoeff(&up);
  const double side = shares[up] < 0 ? -1 : 1;
  outline.part = static_cast<int>(2 * up + (side > 0 ? 1 : 0));
  if (is_box()) {
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
