// A rigid body within the substeps of a step: forces that act on it, and how it moves
// (server/solver/method.md, "Bodies"). Pure.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "server/scene/body_mass.h"
#include "server/scene/rigid_motion.h"

namespace drape {

// Positions as in the motion's frame. The angular momentum is what impulses change and what stays
// without them; the turn of a substep follows from it and from the inertia in its middle.
class RigidBody {
 public:
  // `motion`: its pivot is the centre of mass. At the start of a step.
  RigidBody(const BodyMass& mass, const RigidMotion& motion);

  // A substep of `seconds` begins, in which gravity and the impulses of Push act.
  void Begin(double seconds, const Eigen::Vector3d& gravity_m_per_s2);
  // The substep is over: motion() is that at its end, and later impulses change that.
  void End();

  // An impulse [N s] at `arm_m` from the centre.
  void Push(const Eigen::Vector3d& impulse, const Eigen::Vector3d& arm_m);
  // Impulses that add up to these; the moment about the centre [N m s].
  void Change(const Eigen::Vector3d& impulse, const Eigen::Vector3d& moment);
  // Between Begin and End: moves and turns where the substep ends. No velocity changes [m, rad].
  void Shift(const Eigen::Vector3d& way_m, const Eigen::Vector3d& turn_rad);
  // Velocity along the unit vector n, of the point at `arm_m`, per impulse along n there [1/kg].
  double MobilityAlong(const Eigen::Vector3d& n, const Eigen::Vector3d& arm_m) const;
  // Of the point at `arm_m` [m/s].
  Eigen::Vector3d VelocityAt(const Eigen::Vector3d& arm_m) const {
    return motion_.velocity_m_per_s + motion_.angular_velocity_rad_per_s.cross(arm_m);
  }

  // Between Begin and End: the pose at the start of the substep and its mean velocities over it;
  // otherwise pose and velocities at the moment.
  const RigidMotion& motion() const { return motion_; }
  // Where the substep ends.
  RigidMotion AtEnd() const;
  const Eigen::Vector3d& angular_momentum() const { return angular_momentum_; }  // [N m s]
  double mass_kg() const { return mass_kg_; }
  // World axes; of the middle of the substep between Begin and End, else of the moment.
  const Eigen::Matrix3d& inverse_inertia() const { return inverse_inertia_; }
  Eigen::Matrix3d InverseInertiaAt(const Eigen::Quaterniond& rotation) const;
  // With the angular momentum L it would have this energy of rotation in another pose [J].
  double SpinEnergyAt(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& momentum) const {
    return momentum.dot(InverseInertiaAt(rotation) * momentum) / 2;
  }

 private:
  double mass_kg_;
  Eigen::Matrix3d inverse_inertia_described_;  // axes as described [1/(kg m^2)]
  RigidMotion motion_;
  Eigen::Vector3d angular_momentum_;
  Eigen::Matrix3d inverse_inertia_;  // in the middle of the substep, or at the moment
  Eigen::Vector3d kick_m_per_s_ = Eigen::Vector3d::Zero();  // of gravity in half a substep
  double seconds_ = 0;
  // Of where the substep ends.
  Eigen::Vector3d shift_m_ = Eigen::Vector3d::Zero();
  Eigen::Quaterniond shift_turn_ = Eigen::Quaterniond::Identity();
};

}  // namespace drape
