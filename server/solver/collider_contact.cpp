#include "server/solver/collider_contact.h"

#include <algorithm>

#include "server/solver/solver_constants.h"

namespace drape {
namespace {

// A plane meets what is between particles only where it meets one of them. Bodies meet particles.
bool CanTouchEdges(const Collider& collider) {
  return collider.kind() != ShapeKind::kPlane && !collider.is_body();
}

// Whether edges of this length can be caught by it (kSharpRadius).
bool IsSharp(const Collider& collider, double edge_length_m) {
  switch (collider.kind()) {
    case ShapeKind::kBox:
    case ShapeKind::kCylinder:
      return true;
    case ShapeKind::kSphere:
      return std::get<SphereShape>(collider.shape).radius_m < kSharpRadius * edge_length_m;
    case ShapeKind::kCapsule:
      return std::get<CapsuleShape>(collider.shape).radius_m < kSharpRadius * edge_length_m;
    default:
      return false;
  }
}

bool Moves(const RigidMotion& motion) {
  return !motion.velocity_m_per_s.isZero(0) || !motion.angular_velocity_rad_per_s.isZero(0);
}

}  // namespace

bool TouchesEdges(ColliderContact contact, const Collider& collider, const RigidMotion* motion,
                  double edge_length_m) {
  if (!CanTouchEdges(collider)) return false;
  switch (contact) {
    case ColliderContact::kParticles:
      return false;
    case ColliderContact::kSurface:
      return true;
    case ColliderContact::kAuto:
      return motion != nullptr && Moves(*motion) && IsSharp(collider, edge_length_m);
  }
  return false;
}

bool HasSurfaceContacts(const SceneModel& model, const ClothParameters& parameters) {
  const ColliderContact contact = parameters.settings.collider_contact;
  if (contact == ColliderContact::kParticles || model.constraint_count() == 0) return false;
  if (contact == ColliderContact::kAuto && !HasMovingColliders(parameters)) return false;
  return std::ranges::any_of(parameters.colliders, [&](const Collider& collider) {
    return CanTouchEdges(collider) &&
           (contact == ColliderContact::kSurface || IsSharp(collider, model.length_scale_m()));
  });
}

}  // namespace drape
