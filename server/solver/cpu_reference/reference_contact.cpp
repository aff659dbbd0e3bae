#include "server/solver/cpu_reference/reference_contact.h"

#include <algorithm>
#include <cmath>

#include "server/scene/distance_map.h"
#include "server/solver/solver_constants.h"

namespace drape {

namespace {

ReferenceContact ContactWith(const SphereCollider& sphere, const Eigen::Vector3d& q) {
  const Eigen::Vector3d from_center = q - sphere.center_m;
  const double distance = from_center.norm();
  if (distance < kMinDirectionLength_m) return {-sphere.radius_m, Eigen::Vector3d::UnitY()};
  return {distance - sphere.radius_m, from_center / distance};
}

ReferenceContact ContactWith(const PlaneCollider& plane, const Eigen::Vector3d& q) {
  return {(q - plane.point_m).dot(plane.normal), plane.normal};
}

// The distance to the nearest point of the segment less the radius.
ReferenceContact ContactWith(const CapsuleCollider& capsule, const Eigen::Vector3d& q) {
  const Eigen::Vector3d segment = capsule.b_m - capsule.a_m;
  const bool is_point = segment.norm() < kMinDirectionLength_m;
  const double along =
      is_point ? 0 : std::clamp((q - capsule.a_m).dot(segment) / segment.squaredNorm(), 0.0, 1.0);
  const Eigen::Vector3d from_nearest = q - (capsule.a_m + along * segment);
  const double distance = from_nearest.norm();
  if (distance < kMinDirectionLength_m) return {-capsule.radius_m, NormalOnSegment(capsule)};
  return {distance - capsule.radius_m, from_nearest / distance};
}

// In the box's axes: the nearest point of a box is q itself with each coordinate clamped to the
// half extents, so the difference to it is `outside`. Where at most one coordinate lies beyond its
// face (inside, and above a face), the face's own normal is exact.
ReferenceContact ContactWith(const BoxCollider& box, const Eigen::Vector3d& q) {
  const Eigen::Vector3d local = box.rotation.conjugate() * (q - box.center_m);
  const Eigen::Vector3d side = (local.array() < 0).select(-Eigen::Array3d::Ones(), 1);
  const Eigen::Vector3d beyond = local.cwiseAbs() - box.half_extents_m;  // < 0: within the slab
  const Eigen::Vector3d outside = beyond.cwiseMax(0);
  const double distance = outside.norm();
  const bool is_beyond_edge = (beyond.array() > 0).count() > 1 && distance >= kMinDirectionLength_m;
  if (is_beyond_edge) return {distance, box.rotation * (side.cwiseProduct(outside) / distance)};
  Eigen::Index nearest_face = 0;
  const double above_face = beyond.maxCoeff(&nearest_face);
  return {above_face, box.rotation * (side[nearest_face] * Eigen::Vector3d::Unit(nearest_face))};
}

// In the mesh's frame, where the map knows the interpolated distance and its normalised gradient.
ReferenceContact ContactWith(const DistanceMapCollider& solid, const Eigen::Vector3d& q) {
  const RigidTransform& transform = solid.transform;
  const Eigen::Vector3d local = transform.rotation.conjugate() * (q - transform.position_m);
  const SurfaceDistance surface = solid.map->SurfaceAt(local);
  return {surface.distance_m, transform.rotation * surface.outward};
}

}  // namespace

ReferenceContact ContactAt(const Collider& collider, double thickness_m, const Eigen::Vector3d& q) {
  ReferenceContact contact =
      std::visit([&](const auto& shape) { return ContactWith(shape, q); }, collider);
  contact.gap -= thickness_m;
  return contact;
}

ReferenceContact ContactAt(const Collider& collider, const RigidMotion& motion, double thickness_m,
                           const Eigen::Vector3d& q) {
  ReferenceContact contact = ContactAt(collider, thickness_m, motion.DescribedAt(q));
  contact.normal = motion.rotation * contact.normal;
  return contact;
}

double ReboundSpeed(const ReferenceContact& contact, const Eigen::Vector3d& velocity_m_per_s,
                    const Eigen::Vector3d& gravity_m_per_s2, double restitution,
                    double slowest_m_per_s) {
  const double approach = -velocity_m_per_s.dot(contact.normal);
  if (approach <= slowest_m_per_s) return 0;
  const double gained = -2 * gravity_m_per_s2.dot(contact.normal) * std::max(contact.gap, 0.0);
  return restitution * std::sqrt(std::max(approach * approach + gained, 0.0));
}

Eigen::Vector3d CoulombImpulse(const Eigen::Vector3d& wanted, double normal_impulse,
                               double friction_static, double friction_dynamic) {
  const double size = wanted.norm();
  if (size <= friction_static * normal_impulse) return wanted;
  return wanted * (friction_dynamic * normal_impulse / size);
}

}  // namespace drape
