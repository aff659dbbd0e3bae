#include "server/solver/cpu/step/collider_surface.h"

namespace drape::cpu {
namespace {

Lanes Cross(Lanes a, Lanes b) {
  return Lanes{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0};
}

}  // namespace

MovingSurface::Pose::Pose(const RigidMotion& motion) : position(ToLanes(motion.position_m)) {
  const Eigen::Matrix3d rotation = motion.rotation.toRotationMatrix();
  columns = {ToLanes(rotation.col(0)), ToLanes(rotation.col(1)), ToLanes(rotation.col(2))};
}

MovingSurface::MovingSurface(const FloatCollider& collider, const RigidMotion& motion,
                             double begin_s, double end_s)
    : collider_(&collider),
      pivot_(ToLanes(motion.pivot_m)),
      start_(motion.After(begin_s)),
      end_(motion.After(end_s)),
      velocity_(ToLanes(motion.velocity_m_per_s)),
      angular_velocity_(ToLanes(motion.angular_velocity_rad_per_s)) {
  const ChordFactors chord = motion.ChordOver(end_s - begin_s);
  chord_sine_ = static_cast<float>(chord.sine);
  chord_cosine_ = static_cast<float>(chord.cosine_s);
}

Gap MovingSurface::GapAt(const Pose& pose, Lanes q) const {
  const Lanes d = q - pose.position;
  const Lanes described =
      pivot_ + Lanes{Dot(pose.columns[0], d), Dot(pose.columns[1], d), Dot(pose.columns[2], d), 0};
  const Gap gap = collider_->GapAt(described);
  return {gap.gap, gap.normal[0] * pose.columns[0] + gap.normal[1] * pose.columns[1] +
                       gap.normal[2] * pose.columns[2]};
}

Lanes MovingSurface::VelocityAt(const Pose& pose, Lanes place) const {
  return velocity_ + Cross(angular_velocity_, place - pose.position);
}

// v + (R r - r)/h for r from the position of the pivot, without the difference: with a = |w| h,
// sin(a)/a w x r + h (1 - cos(a))/a^2 w x (w x r).
Lanes MovingSurface::MeanVelocity(Lanes place) const {
  const Lanes tangent = Cross(angular_velocity_, place - start_.position);
  return velocity_ + chord_sine_ * tangent + chord_cosine_ * Cross(angular_velocity_, tangent);
}

}  // namespace drape::cpu
