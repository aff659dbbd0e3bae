#include "server/solver/bodies/rigid_body.h"

namespace drape {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// Most rounds in which the turn of half a substep and the inertia after it are brought together
// [-], and the relative change below which they agree. Each round multiplies the error by about the
// angle of that turn; what is left after the last one is of no harm to the angular momentum.
constexpr int kMostRounds = 12;
constexpr double kAgreement = 1e-15;

Quaterniond Turned(const Quaterniond& rotation, const Vector3d& rate, double seconds) {
  RigidMotion turning{.rotation = rotation, .angular_velocity_rad_per_s = rate};
  return turning.After(seconds).rotation;
}

}  // namespace

RigidBody::RigidBody(const BodyMass& mass, const RigidMotion& motion)
    : mass_kg_(mass.mass_kg),
      inverse_inertia_described_(mass.inertia.inverse()),
      motion_(motion),
      inverse_inertia_(InverseInertiaAt(motion.rotation)) {
  const Matrix3d turned = motion.rotation.toRotationMatrix();
  angular_momentum_ =
      turned * (mass.inertia * (turned.transpose() * motion.angular_velocity_rad_per_s));
}

Matrix3d RigidBody::InverseInertiaAt(const Quaterniond& rotation) const {
  const Matrix3d turned = rotation.toRotationMatrix();
  return turned * inverse_inertia_described_ * turned.transpose();
}

void RigidBody::Begin(double seconds, const Vector3d& gravity_m_per_s2) {
  seconds_ = seconds;
  shift_m_.setZero();
  shift_turn_.setIdentity();
  kick_m_per_s_ = seconds / 2 * gravity_m_per_s2;
  motion_.velocity_m_per_s += kick_m_per_s_;
  Vector3d rate = motion_.angular_velocity_rad_per_s;
  for (int round = 0; round < kMostRounds; ++round) {
    inverse_inertia_ = InverseInertiaAt(Turned(motion_.rotation, rate, seconds / 2));
    const Vector3d next = inverse_inertia_ * angular_momentum_;
    const double change = (next - rate).norm();
    rate = next;
    if (!(change > kAgreement * rate.norm())) break;
  }
  motion_.angular_velocity_rad_per_s = rate;
}

RigidMotion RigidBody::AtEnd() const {
  RigidMotion end = motion_.After(seconds_);
  end.position_m += shift_m_;
  // The motions of what is not shifted keep their bits.
  if (shift_turn_.vec() != Vector3d::Zero()) {
    end.rotation = (shift_turn_ * end.rotation).normalized();
  }
  return end;
}

void RigidBody::Shift(const Vector3d& way_m, const Vector3d& turn_rad) {
  shift_m_ += way_m;
  shift_turn_ = Turned(shift_turn_, turn_rad, 1).normalized();
}

void RigidBody::End() {
  motion_ = AtEnd();
  motion_.velocity_m_per_s += kick_m_per_s_;
  inverse_inertia_ = InverseInertiaAt(motion_.rotation);
  motion_.angular_velocity_rad_per_s = inverse_inertia_ * angular_momentum_;
}

void RigidBody::Push(const Vector3d& impulse, const Vector3d& arm_m) {
  Change(impulse, arm_m.cross(impulse));
}

void RigidBody::Change(const Vector3d& impulse, const Vector3d& moment) {
  motion_.velocity_m_per_s += impulse / mass_kg_;
  angular_momentum_ += moment;
  motion_.angular_velocity_rad_per_s = inverse_inertia_ * angular_momentum_;
}

double RigidBody::MobilityAlong(const Vector3d& n, const Vector3d& arm_m) const {
  const Vector3d moment = arm_m.cross(n);
  return 1 / mass_kg_ + moment.dot(inverse_inertia_ * moment);
}

}  // namespace drape
