#include "server/scene/colliders.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "server/scene/distance_map.h"

namespace drape {
namespace {

using Eigen::Vector3d;

// Below this length [m] a difference of two positions has no direction.
constexpr double kMinLength_m = 1e-12;

template <class AnyShape>
Vector3d Centre(const AnyShape&, const RigidTransform& pose) {
  return pose.position_m;
}

SurfaceDistance Surface(const SphereShape& sphere, const RigidTransform& pose, const Vector3d& q) {
  const Vector3d from_center = q - pose.position_m;
  const double distance = from_center.norm();
  if (distance < kMinLength_m) return {-sphere.radius_m, Vector3d::UnitY()};
  return {distance - sphere.radius_m, from_center / distance};
}

double HalfWidth_m(const SphereShape& sphere) {
  return sphere.radius_m;
}

ColliderNumbers Numbers(const SphereShape& sphere, const RigidTransform& pose) {
  return {.radius_m = sphere.radius_m, .point_m = pose.position_m};
}

double HalfWidth_m(const PlaneShape&) {
  return std::numeric_limits<double>::infinity();
}

SurfaceDistance Surface(const PlaneShape& plane, const RigidTransform& pose, const Vector3d& q) {
  const Vector3d normal = pose.rotation * plane.normal;
  return {(q - pose.position_m).dot(normal), normal};
}

// By the point nearest to the origin, which is where the cloth is: gaps are rounded to the digits
// of its coordinates.
ColliderNumbers Numbers(const PlaneShape& plane, const RigidTransform& pose) {
  const Vector3d normal = pose.rotation * plane.normal;
  return {.point_m = pose.position_m.dot(normal) * normal, .vector = normal};
}

Vector3d Centre(const CapsuleShape& capsule, const RigidTransform& pose) {
  return (pose * capsule.a_m + pose * capsule.b_m) / 2;
}

// The distance to the nearest point of the segment less the radius.
SurfaceDistance Surface(const CapsuleShape& capsule, const RigidTransform& pose,
                        const Vector3d& q) {
  const Vector3d a = pose * capsule.a_m;
  const Vector3d segment = pose * capsule.b_m - a;
  const bool is_point = segment.norm() < kMinLength_m;
  const double along =
      is_point ? 0 : std::clamp((q - a).dot(segment) / segment.squaredNorm(), 0.0, 1.0);
  const Vector3d from_nearest = q - (a + along * segment);
  const double distance = from_nearest.norm();
  if (distance < kMinLength_m) return {-capsule.radius_m, NormalOnSegment(segment)};
  return {distance - capsule.radius_m, from_nearest / distance};
}

double HalfWidth_m(const CapsuleShape& capsule) {
  return capsule.radius_m;
}

ColliderNumbers Numbers(const CapsuleShape& capsule, const RigidTransform& pose) {
  const Vector3d a = pose * capsule.a_m;
  const Vector3d segment = pose * capsule.b_m - a;
  ColliderNumbers numbers{.radius_m = capsule.radius_m, .point_m = a, .vector = segment};
  numbers.axes.col(0) = NormalOnSegment(segment);
  return numbers;
}

// The nearest point of a box is the point itself with each coordinate clamped to the half extents,
// so the difference to it is `outside`. The face's own normal is exact where at most one coordinate
// lies beyond its face (inside, and above a face).
SurfaceDistance Surface(const BoxShape& box, const RigidTransform& pose, const Vector3d& q) {
  const Vector3d local = pose.rotation.conjugate() * (q - pose.position_m);
  const Vector3d side = (local.array() < 0).select(-Eigen::Array3d::Ones(), 1);
  const Vector3d beyond = local.cwiseAbs() - box.half_extents_m;  // < 0: within the slab
  const Vector3d outside = beyond.cwiseMax(0);
  const double distance = outside.norm();
  const bool is_beyond_edge = (beyond.array() > 0).count() > 1 && distance >= kMinLength_m;
  if (is_beyond_edge) return {distance, pose.rotation * (side.cwiseProduct(outside) / distance)};
  Eigen::Index nearest_face = 0;
  const double above_face = beyond.maxCoeff(&nearest_face);
  return {above_face, pose.rotation * (side[nearest_face] * Vector3d::Unit(nearest_face))};
}

double HalfWidth_m(const BoxShape& box) {
  return box.half_extents_m.minCoeff();
}

ColliderNumbers Numbers(const BoxShape& box, const RigidTransform& pose) {
  return {.point_m = pose.position_m,
          .vector = box.half_extents_m,
          .axes = pose.rotation.toRotationMatrix()};
}

Vector3d Centre(const CylinderShape& cylinder, const RigidTransform& pose) {
  return (pose * cylinder.a_m + pose * cylinder.b_m) / 2;
}

// In the half-plane through the axis and the point a cylinder is a rectangle: the distance is that
// of its side or its nearer end, beyond both that of the rim.
SurfaceDistance Surface(const CylinderShape& cylinder, const RigidTransform& pose,
                        const Vector3d& q) {
  const Vector3d segment = pose * cylinder.b_m - pose * cylinder.a_m;
  const Vector3d axis = segment.normalized();
  const Vector3d from_middle = q - Centre(cylinder, pose);
  const double along = from_middle.dot(axis);
  const Vector3d across = from_middle - along * axis;
  const double from_axis = across.norm();
  Vector3d sideways = NormalOnSegment(segment);
  if (from_axis >= kMinLength_m) sideways = across / from_axis;
  const Vector3d endways = (along < 0 ? -1 : 1) * axis;
  const double beyond_side = from_axis - cylinder.radius_m;
  const double beyond_end = std::abs(along) - segment.norm() / 2;
  const double from_rim = std::hypot(beyond_side, beyond_end);
  if (std::min(beyond_side, beyond_end) > 0 && from_rim >= kMinLength_m) {
    return {from_rim, (beyond_side * sideways + beyond_end * endways) / from_rim};
  }
  if (beyond_side < beyond_end) return {beyond_end, endways};
  return {beyond_side, sideways};
}

double HalfWidth_m(const CylinderShape& cylinder) {
  return std::min(cylinder.radius_m, (cylinder.b_m - cylinder.a_m).norm() / 2);
}

ColliderNumbers Numbers(const CylinderShape& cylinder, const RigidTransform& pose) {
  const Vector3d segment = pose * cylinder.b_m - pose * cylinder.a_m;
  ColliderNumbers numbers{.radius_m = cylinder.radius_m,
                          .point_m = Centre(cylinder, pose),
                          .vector = {cylinder.radius_m, segment.norm() / 2, 0}};
  numbers.axes.col(0) = segment.normalized();
  numbers.axes.col(1) = NormalOnSegment(segment);
  return numbers;
}

// In the map's frame, where it knows the interpolated distance and its normalised gradient.
SurfaceDistance Surface(const DistanceMapShape& solid, const RigidTransform& pose,
                        const Vector3d& q) {
  const Vector3d local = pose.rotation.conjugate() * (q - pose.position_m);
  const SurfaceDistance surface = solid.map->SurfaceAt(local);
  return {surface.distance_m, pose.rotation * surface.outward};
}

double HalfWidth_m(const DistanceMapShape& solid) {
  return std::max(solid.map->depth_m(), solid.map->cell_m() / 2);
}

ColliderNumbers Numbers(const DistanceMapShape& solid, const RigidTransform& pose) {
  return {.point_m = pose * solid.map->low_m(), .axes = pose.rotation.toRotationMatrix()};
}

}  // namespace

bool HasBodies(std::span<const Collider> colliders) {
  return std::ranges::any_of(colliders, &Collider::is_body);
}

Collider SphereAt(const Vector3d& center_m, double radius_m) {
  return {SphereShape{radius_m}, {center_m}};
}

Collider PlaneThrough(const Vector3d& point_m, const Vector3d& normal) {
  return {PlaneShape{normal}, {point_m}};
}

Collider CapsuleBetween(const Vector3d& a_m, const Vector3d& b_m, double radius_m) {
  return {CapsuleShape{a_m, b_m, radius_m}};
}

Collider BoxAt(const Vector3d& center_m, const Vector3d& half_extents_m,
               const Eigen::Quaterniond& rotation) {
  return {BoxShape{half_extents_m}, {center_m, rotation}};
}

Collider CylinderBetween(const Vector3d& a_m, const Vector3d& b_m, double radius_m) {
  return {CylinderShape{a_m, b_m, radius_m}};
}

Collider DistanceMapAt(std::shared_ptr<const DistanceMap> map, const RigidTransform& pose) {
  return {DistanceMapShape{std::move(map)}, pose};
}

std::shared_ptr<const DistanceMap> MapOf(const Collider& collider) {
  const auto* solid = std::get_if<DistanceMapShape>(&collider.shape);
  return solid != nullptr ? solid->map : nullptr;
}

Vector3d CentreOf(const Collider& collider) {
  return std::visit([&](const auto& shape) { return Centre(shape, collider.pose); },
                    collider.shape);
}

Collider Moved(const Collider& collider, const RigidMotion& motion) {
  const auto& [position_m, rotation] = collider.pose;
  Collider moved = collider;
  moved.pose = {motion.PlaceOf(position_m), motion.rotation * rotation};
  return moved;
}

double HalfWidth_m(const Collider& collider) {
  return std::visit([](const auto& shape) { return HalfWidth_m(shape); }, collider.shape);
}

SurfaceDistance SurfaceOf(const Collider& collider, const Vector3d& q) {
  return std::visit([&](const auto& shape) { return Surface(shape, collider.pose, q); },
                    collider.shape);
}

Vector3d NormalOnSegment(const Vector3d& segment_m) {
  if (segment_m.isZero(0)) return Vector3d::UnitY();
  const Vector3d axis = segment_m.stableNormalized();
  const bool is_steep = std::abs(axis.y()) > 0.9;
  const Vector3d side = is_steep ? Vector3d::UnitX() : Vector3d::UnitY();
  return (side - side.dot(axis) * axis).normalized();
}

ColliderNumbers NumbersOf(const Collider& collider) {
  return std::visit([&](const auto& shape) { return Numbers(shape, collider.pose); },
                    collider.shape);
}

}  // namespace drape
