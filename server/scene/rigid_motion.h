// Motion of rigid bodies. Pure.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace drape {

// Factors of the way of a turning body within some time, by the angle a of the turn: sin(a)/a, and
// the time times (1 - cos(a))/a^2 [s].
struct ChordFactors {
  double sine = 1;
  double cosine_s = 0;
};

// A body whose pivot moves with constant velocity and which turns about it with constant angular
// velocity. «Described» points are those of the body as it was described, in the same frame.
struct RigidMotion {
  Eigen::Vector3d pivot_m = Eigen::Vector3d::Zero();  // described
  // At time 0: the place of the pivot, and the rotation from the description.
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // unit
  Eigen::Vector3d velocity_m_per_s = Eigen::Vector3d::Zero();    // of the pivot
  Eigen::Vector3d angular_velocity_rad_per_s = Eigen::Vector3d::Zero();

  // As described, at rest.
  static RigidMotion AtRest(const Eigen::Vector3d& pivot_m) {
    return {.pivot_m = pivot_m, .position_m = pivot_m};
  }

  // The same motion with `seconds` as time 0.
  RigidMotion After(double seconds) const;
  // The way from the pose of this motion to that of `end`, in `seconds` > 0: straight, and turning
  // about one axis, the shorter way.
  RigidMotion Towards(const RigidMotion& end, double seconds) const;

  // A point at r from the pivot moves from time 0 on at the mean velocity v + sine w x r + cosine_s
  // w x (w x r) over `seconds` > 0.
  ChordFactors ChordOver(double seconds) const;

  // At time 0.
  Eigen::Vector3d PlaceOf(const Eigen::Vector3d& described_m) const {
    return position_m + rotation * (described_m - pivot_m);
  }
  Eigen::Vector3d DescribedAt(const Eigen::Vector3d& place_m) const {
    return pivot_m + rotation.conjugate() * (place_m - position_m);
  }
  Eigen::Vector3d VelocityAt(const Eigen::Vector3d& place_m) const {
    return velocity_m_per_s + angular_velocity_rad_per_s.cross(place_m - position_m);
  }
};

}  // namespace drape
