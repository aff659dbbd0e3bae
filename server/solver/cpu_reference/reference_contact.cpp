#include "server/solver/cpu_reference/reference_contact.h"

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

}  // namespace

ReferenceContact ContactAt(const Collider& collider, double thickness_m, const Eigen::Vector3d& q) {
  ReferenceContact contact =
      std::visit([&](const auto& shape) { return ContactWith(shape, q); }, collider);
  contact.gap -= thickness_m;
  return contact;
}

Eigen::Vector3d CoulombImpulse(const Eigen::Vector3d& wanted, double normal_impulse,
                               double friction_static, double friction_dynamic) {
  const double size = wanted.norm();
  if (size <= friction_static * normal_impulse) return wanted;
  return wanted * (friction_dynamic * normal_impulse / size);
}

}  // namespace drape
