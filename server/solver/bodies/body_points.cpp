#include "server/solver/bodies/body_points.h"

#include <cmath>
#include <numbers>
#include <variant>

#include "server/scene/distance_map.h"

namespace drape::bodies {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

BodyPoints Of(const SphereShape& sphere) {
  return {{Vector3d::Zero()}, sphere.radius_m};
}

BodyPoints Of(const PlaneShape&) {
  return {};
}

BodyPoints Of(const CapsuleShape& capsule) {
  return {{capsule.a_m, capsule.b_m}, capsule.radius_m};
}

BodyPoints Of(const BoxShape& box) {
  BodyPoints points;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d sides(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    points.places_m.push_back(sides.cwiseProduct(box.half_extents_m));
  }
  return points;
}

BodyPoints Of(const CylinderShape& cylinder) {
  const Vector3d segment = cylinder.b_m - cylinder.a_m;
  const Vector3d side = NormalOnSegment(segment);
  const Vector3d other = segment.stableNormalized().cross(side);
  BodyPoints points;
  for (int k = 0; k < kRimPoints; ++k) {
    const double angle = 2 * pi * k / kRimPoints;
    const Vector3d from_axis =
        cylinder.radius_m * (std::cos(angle) * side + std::sin(angle) * other);
    points.places_m.push_back(cylinder.a_m + from_axis);
    points.places_m.push_back(cylinder.b_m + from_axis);
  }
  return points;
}

BodyPoints Of(const DistanceMapShape& solid) {
  return {solid.map->outermost_m(), 0};
}

}  // namespace

BodyPoints PointsOf(const Collider& collider) {
  BodyPoints points = std::visit([](const auto& shape) { return Of(shape); }, collider.shape);
  for (Vector3d& place : points.places_m) place = collider.pose * place;
  return points;
}

}  // namespace drape::bodies
