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

// Whether it may have come through the cloth.
bool Slips(const Collider& collider, double edge_length_m) {
  const double least_m = kSlipRadius * edge_length_m;
  if (const auto* box = std::get_if<BoxShape>(&collider.shape)) {
    return (box->half_extents_m.array() < least_m).count() >= 2;
  }
  if (const auto* ball = std::get_if<SphereShape>(&collider.shape)) return ball->radius_m < least_m;
  if (const auto* capsule = std::get_if<CapsuleShape>(&collider.shape)) {
    return capsule->radius_m < least_m;
  }
  const auto* cylinder = std::get_if<CylinderShape>(&collider.shape);
  return cylinder != nullptr && cylinder->radius_m < least_m;
}

// Whether the point of the description that is at `described_m` moves.
bool Moves(const RigidMotion& motion, const Eigen::Vector3d& described_m) {
  constexpr double kStill_m_per_s = 1e-6;  // above the rounding of a roller's axis
  const Eigen::Vector3d arm = motion.rotation * (described_m - motion.pivot_m);
  return (motion.velocity_m_per_s + motion.angular_velocity_rad_per_s.cross(arm)).norm() >
         kStill_m_per_s;
}

// Whether it comes to be where it was not: a roller that turns about its axis does not.
bool Moves(const RigidMotion& motion, const Collider& collider) {
  const auto moves = [&](const Eigen::Vector3d& end) { return Moves(motion, collider.pose * end); };
  if (const auto* capsule = std::get_if<CapsuleShape>(&collider.shape)) {
    return moves(capsule->a_m) || moves(capsule->b_m);
  }
  if (const auto* cylinder = std::get_if<CylinderShape>(&collider.shape)) {
    return moves(cylinder->a_m) || moves(cylinder->b_m);
  }
  if (collider.kind() == ShapeKind::kSphere) return moves(Eigen::Vector3d::Zero());
  return !motion.velocity_m_per_s.isZero(0) || !motion.angular_velocity_rad_per_s.isZero(0);
}

// Whether the edges of the cloth may touch some collider of which `may_touch` is true.
template <class MayTouch>
bool TouchesAny(const SceneModel& model, const ClothParameters& parameters,
                const MayTouch& may_touch) {
  if (parameters.settings.collider_contact == ColliderContact::kParticles) return false;
  if (model.constraint_count() == 0) return false;
  return std::ranges::any_of(parameters.colliders, [&](const Collider& collider) {
    return CanTouchEdges(collider) && may_touch(collider);
  });
}

// The same of steps in which the cloth is slow.
bool HasSurfaceContactsSlowly(const SceneModel& model, const ClothParameters& parameters,
                              bool may_pull) {
  const bool is_surface = parameters.settings.collider_contact == ColliderContact::kSurface;
  if (!is_surface && !may_pull && !HasMovingColliders(parameters)) return false;
  return TouchesAny(model, parameters, [&](const Collider& collider) {
    return is_surface || IsSharp(collider, model.length_scale_m());
  });
}

// Whether a particle may come beyond its middle within a substep.
bool IsThinFor(const EdgesOfStep& edges, const Collider& collider, const RigidMotion* motion) {
  const double own_speed_m_per_s = motion != nullptr ? motion->velocity_m_per_s.norm() : 0;
  const double way_m = edges.way_m + own_speed_m_per_s * edges.substep_s;
  return way_m > kThinShare * HalfWidth_m(collider);
}

}  // namespace

double WayInSubstep_m(double speed_m_per_s, double gravity_m_per_s2, double time_step_s,
                      size_t substeps) {
  const double fastest_m_per_s = speed_m_per_s + gravity_m_per_s2 * time_step_s;
  return kWayMargin * fastest_m_per_s * time_step_s / static_cast<double>(substeps);
}

bool Pulls(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double time_step_s) {
  return (to_m - from_m).norm() > kStillHold_m_per_s * time_step_s;
}

bool TouchesEdges(const EdgesOfStep& edges, const Collider& collider, const RigidMotion* motion) {
  if (!CanTouchEdges(collider)) return false;
  switch (edges.contact) {
    case ColliderContact::kParticles:
      return false;
    case ColliderContact::kSurface:
      return true;
    case ColliderContact::kAuto:
      break;
  }
  const bool is_sharp = IsSharp(collider, edges.length_m);
  if (is_sharp && motion != nullptr && Moves(*motion, collider)) return true;
  const bool may_catch = (is_sharp && edges.is_pulled) || IsThinFor(edges, collider, motion);
  return may_catch && !Slips(collider, edges.length_m);
}

bool HasSurfaceContacts(const SceneModel& model, const ClothParameters& parameters) {
  return TouchesAny(model, parameters, [](const Collider&) { return true; });
}

bool HasSurfaceContactsPulled(const SceneModel& model, const ClothParameters& parameters) {
  const bool may_pull = model.pin_count() + parameters.max_grips > 0;
  return HasSurfaceContactsSlowly(model, parameters, may_pull);
}

bool HasSurfaceContactsUnpulled(const SceneModel& model, const ClothParameters& parameters) {
  return HasSurfaceContactsSlowly(model, parameters, false);
}

}  // namespace drape
