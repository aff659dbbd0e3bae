#include "server/scene/collider_surface.h"

#include <algorithm>

namespace drape {
namespace {

// Below this length [m] a difference of two positions has no direction.
constexpr double kMinLength_m = 1e-12;

SurfaceDistance SurfaceOfShape(const SphereCollider& sphere, const Eigen::Vector3d& q) {
  const Eigen::Vector3d from_center = q - sphere.center_m;
  const double distance = from_center.norm();
  if (distance < kMinLength_m) return {-sphere.radius_m, Eigen::Vector3d::UnitY()};
  return {distance - sphere.radius_m, from_center / distance};
}

SurfaceDistance SurfaceOfShape(const PlaneCollider& plane, const Eigen::Vector3d& q) {
  return {(q - plane.point_m).dot(plane.normal), plane.normal};
}

// The distance to the nearest point of the segment less the radius.
SurfaceDistance SurfaceOfShape(const CapsuleCollider& capsule, const Eigen::Vector3d& q) {
  const Eigen::Vector3d segment = capsule.b_m - capsule.a_m;
  const bool is_point = segment.norm() < kMinLength_m;
  const double along =
      is_point ? 0 : std::clamp((q - capsule.a_m).dot(segment) / segment.squaredNorm(), 0.0, 1.0);
  const Eigen::Vector3d from_nearest = q - (capsule.a_m + along * segment);
  const double distance = from_nearest.norm();
  if (distance < kMinLength_m) return {-capsule.radius_m, NormalOnSegment(capsule)};
  return {distance - capsule.radius_m, from_nearest / distance};
}

// In the box's axes: the nearest point of a box is q itself with each coordinate clamped to the
// half extents, so the difference to it is `outside`. Where at most one coordinate lies beyond its
// face (inside, and above a face), the face's own normal is exact.
SurfaceDistance SurfaceOfShape(const BoxCollider& box, const Eigen::Vector3d& q) {
  const Eigen::Vector3d local = box.rotation.conjugate() * (q - box.center_m);
  const Eigen::Vector3d side = (local.array() < 0).select(-Eigen::Array3d::Ones(), 1);
  const Eigen::Vector3d beyond = local.cwiseAbs() - box.half_extents_m;  // < 0: within the slab
  const Eigen::Vector3d outside = beyond.cwiseMax(0);
  const double distance = outside.norm();
  const bool is_beyond_edge = (beyond.array() > 0).count() > 1 && distance >= kMinLength_m;
  if (is_beyond_edge) return {distance, box.rotation * (side.cwiseProduct(outside) / distance)};
  Eigen::Index nearest_face = 0;
  const double above_face = beyond.maxCoeff(&nearest_face);
  return {above_face, box.rotation * (side[nearest_face] * Eigen::Vector3d::Unit(nearest_face))};
}

// In the mesh's frame, where the map knows the interpolated distance and its normalised gradient.
SurfaceDistance SurfaceOfShape(const DistanceMapCollider& solid, const Eigen::Vector3d& q) {
  const RigidTransform& transform = solid.transform;
  const Eigen::Vector3d local = transform.rotation.conjugate() * (q - transform.position_m);
  const SurfaceDistance surface = solid.map->SurfaceAt(local);
  return {surface.distance_m, transform.rotation * surface.outward};
}

}  // namespace

SurfaceDistance SurfaceOf(const Collider& collider, const Eigen::Vector3d& q) {
  return std::visit([&](const auto& shape) { return SurfaceOfShape(shape, q); }, collider);
}

}  // namespace drape
