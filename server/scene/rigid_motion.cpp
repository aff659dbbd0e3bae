#include "server/scene/rigid_motion.h"

#include <cmath>

namespace drape {

RigidMotion RigidMotion::After(double seconds) const {
  RigidMotion later = *this;
  later.position_m += velocity_m_per_s * seconds;
  const double rate = angular_velocity_rad_per_s.norm();
  if (rate == 0) return later;
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(rate * seconds, angular_velocity_rad_per_s / rate));
  later.rotation = (turn * rotation).normalized();
  return later;
}

RigidMotion RigidMotion::Towards(const RigidMotion& end, double seconds) const {
  RigidMotion way = *this;
  way.velocity_m_per_s = (end.position_m - position_m) / seconds;
  // From the half angle's sine and cosine: exact for the smallest turns too.
  Eigen::Quaterniond turn = end.rotation * rotation.conjugate();
  if (turn.w() < 0) turn.coeffs() *= -1;
  const double sine = turn.vec().norm();
  way.angular_velocity_rad_per_s.setZero();
  if (sine > 0) {
    way.angular_velocity_rad_per_s = turn.vec() / sine * (2 * std::atan2(sine, turn.w()) / seconds);
  }
  return way;
}

ChordFactors RigidMotion::ChordOver(double seconds) const {
  const double angle = angular_velocity_rad_per_s.norm() * seconds;
  if (angle == 0) return {1, seconds / 2};
  // 1 - cos a without the difference.
  const double half_sine = std::sin(angle / 2);
  return {std::sin(angle) / angle, seconds * 2 * half_sine * half_sine / (angle * angle)};
}

}  // namespace drape
