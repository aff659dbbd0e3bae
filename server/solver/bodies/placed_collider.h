// A collider of a cloth with bodies while a substep lasts: kinematic, or a body.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "server/scene/colliders.h"
#include "server/scene/rigid_motion.h"
#include "server/solver/bodies/rigid_body.h"

namespace drape::bodies {

struct PlacedCollider {
  const Collider* collider = nullptr;
  RigidMotion motion;  // of a kinematic one from the start of the step on
  RigidMotion start;   // of the substep
  RigidMotion end;
  std::optional<RigidBody> body{};

  // Places it in a substep that begins `begin_s` after the start of the step.
  void Begin(double begin_s, double seconds, const Eigen::Vector3d& gravity_m_per_s2);
  // The end of the substep is reached.
  void End();

  // Distance and outward normal at q, where it is at the start or at the end of the substep.
  SurfaceDistance SurfaceAtStart(const Eigen::Vector3d& q) const { return SurfaceAt(start, q); }
  SurfaceDistance SurfaceAtEnd(const Eigen::Vector3d& q) const { return SurfaceAt(end, q); }
  // Mean velocity over the substep of the point that is at `place` when it starts [m/s].
  Eigen::Vector3d MeanVelocity(const Eigen::Vector3d& place, double seconds) const {
    return (end.PlaceOf(start.DescribedAt(place)) - place) / seconds;
  }

  // What pushes or changes does nothing, and the mobility is 0, where it is no body.
  double MobilityAlong(const Eigen::Vector3d& n, const Eigen::Vector3d& arm_m) const;
  // While the substep lasts it moves the end of the way too.
  void Push(const Eigen::Vector3d& impulse, const Eigen::Vector3d& arm_m) {
    Change(impulse, arm_m.cross(impulse));
  }
  void Change(const Eigen::Vector3d& impulse, const Eigen::Vector3d& moment);
  // Moves and turns a body where the substep ends, without a change of velocities [m, rad].
  void Shift(const Eigen::Vector3d& way_m, const Eigen::Vector3d& turn_rad);
  // Of its point at `arm_m` from the centre, with the velocities of the moment [m/s].
  Eigen::Vector3d VelocityAt(const Eigen::Vector3d& arm_m) const {
    if (body) return body->VelocityAt(arm_m);
    return end.velocity_m_per_s + end.angular_velocity_rad_per_s.cross(arm_m);
  }

 private:
  SurfaceDistance SurfaceAt(const RigidMotion& pose, const Eigen::Vector3d& q) const;

  bool is_under_way_ = false;
};

// Of gravity on the one relative to the other: kinematic colliders do not fall.
inline double FallOf(const PlacedCollider& solid, const PlacedCollider& other) {
  return (solid.body ? 1 : 0) - (other.body ? 1 : 0);
}

inline Eigen::Vector3d Tangential(const Eigen::Vector3d& v, const Eigen::Vector3d& n) {
  return v - v.dot(n) * n;
}

// Coulomb's law on an accumulated impulse: `wanted` stops the sliding.
inline Eigen::Vector3d LimitFriction(const Eigen::Vector3d& wanted, double normal_impulse,
                                     double friction_static, double friction_dynamic) {
  const double size = wanted.norm();
  if (size <= friction_static * normal_impulse) return wanted;
  return wanted * (friction_dynamic * normal_impulse / size);
}

}  // namespace drape::bodies
