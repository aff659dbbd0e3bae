#include "server/solver/bodies/body_points.h"

#include <cmath>
#include <numbers>
#include <variant>

#include "server/scene/distance_map.h"

namespace drape::bodies {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

// A rim is flat on a surface below this sine of the angle between both [-]. Larger: a tilted
// cylinder stands beside its lowest point by a share of this of its radius; smaller: rounding
// decides where the points are.
constexpr double kFlatSine = 1e-9;

BodyPoints Of(const SphereShape& sphere) {
  return {{Vector3d::Zero()}, sphere.radius_m, {}};
}

BodyPoints Of(const PlaneShape&) {
  return {};
}

BodyPoints Of(const CapsuleShape& capsule) {
  return {{capsule.a_m, capsule.b_m}, capsule.radius_m, {}};
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
  const Vector3d axis = segment.stableNormalized(), side = NormalOnSegment(segment);
  BodyPoints points;
  for (const Vector3d& end : {cylinder.a_m, cylinder.b_m}) {
    points.rims.push_back({end, axis, side, cylinder.radius_m});
  }
  for (int k = 0; k < kRimPoints; ++k) {
    for (const Rim& rim : points.rims) points.places_m.push_back(rim.PlaceOf(k, axis));
  }
  return points;
}

BodyPoints Of(const DistanceMapShape& solid) {
  return {solid.map->outermost_m(), 0, {}};
}

}  // namespace

Vector3d Rim::PlaceOf(int k, const Vector3d& direction) const {
  const Vector3d across = direction - direction.dot(axis) * axis;
  const double size = across.norm();
  const Vector3d first = size > kFlatSine * direction.norm() ? Vector3d(across / size) : side;
  const double angle = 2 * pi * k / kRimPoints;
  const Vector3d from_axis =
      radius_m * (std::cos(angle) * first + std::sin(angle) * axis.cross(first));
  return centre_m + from_axis;
}

void Rim::AddPlaces(const Vector3d& direction, std::vector<Vector3d>& places) const {
  for (int k = 0; k < kRimPoints; ++k) places.push_back(PlaceOf(k, direction));
}

BodyPoints PointsOf(const Collider& collider) {
  BodyPoints points = std::visit([](const auto& shape) { return Of(shape); }, collider.shape);
  for (Vector3d& place : points.places_m) place = collider.pose * place;
  for (Rim& rim : points.rims) {
    rim.centre_m = collider.pose * rim.centre_m;
    rim.axis = collider.pose.rotation * rim.axis;
    rim.side = collider.pose.rotation * rim.side;
  }
  return points;
}

}  // namespace drape::bodies
