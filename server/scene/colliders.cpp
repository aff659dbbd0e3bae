#include "server/scene/colliders.h"

#include <cmath>

namespace drape {

namespace {

Eigen::Vector3d Centre(const SphereCollider& sphere) {
  return sphere.center_m;
}
Eigen::Vector3d Centre(const PlaneCollider& plane) {
  return plane.point_m;
}
Eigen::Vector3d Centre(const CapsuleCollider& capsule) {
  return (capsule.a_m + capsule.b_m) / 2;
}
Eigen::Vector3d Centre(const BoxCollider& box) {
  return box.center_m;
}
Eigen::Vector3d Centre(const DistanceMapCollider& solid) {
  return solid.transform.position_m;
}

void Move(SphereCollider& sphere, const RigidMotion& motion) {
  sphere.center_m = motion.PlaceOf(sphere.center_m);
}
void Move(PlaneCollider& plane, const RigidMotion& motion) {
  plane.point_m = motion.PlaceOf(plane.point_m);
  plane.normal = motion.rotation * plane.normal;
}
void Move(CapsuleCollider& capsule, const RigidMotion& motion) {
  capsule.a_m = motion.PlaceOf(capsule.a_m);
  capsule.b_m = motion.PlaceOf(capsule.b_m);
}
void Move(BoxCollider& box, const RigidMotion& motion) {
  box.center_m = motion.PlaceOf(box.center_m);
  box.rotation = motion.rotation * box.rotation;
}
void Move(DistanceMapCollider& solid, const RigidMotion& motion) {
  solid.transform.position_m = motion.PlaceOf(solid.transform.position_m);
  solid.transform.rotation = motion.rotation * solid.transform.rotation;
}

}  // namespace

Eigen::Vector3d CentreOf(const Collider& collider) {
  return std::visit([](const auto& shape) { return Centre(shape); }, collider);
}

Collider Moved(const Collider& collider, const RigidMotion& motion) {
  Collider moved = collider;
  std::visit([&](auto& shape) { Move(shape, motion); }, moved);
  return moved;
}

Eigen::Vector3d NormalOnSegment(const CapsuleCollider& capsule) {
  const Eigen::Vector3d segment = capsule.b_m - capsule.a_m;
  if (segment.isZero(0)) return Eigen::Vector3d::UnitY();
  const Eigen::Vector3d axis = segment.stableNormalized();
  const bool is_steep = std::abs(axis.y()) > 0.9;
  const Eigen::Vector3d side = is_steep ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  return (side - side.dot(axis) * axis).normalized();
}

}  // namespace drape
