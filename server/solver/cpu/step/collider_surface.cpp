#include "server/solver/cpu/step/collider_surface.h"

#include "server/solver/cpu/step/collider_gap.h"

namespace drape::cpu {
namespace {

Vec4 Cross(Vec4 a, Vec4 b) {
  return Vec4{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0};
}

}  // namespace

MovingSurface::Pose::Pose(const Eigen::Vector3d& position_m, const Eigen::Quaterniond& rotation)
    : position(ToVec4(position_m)) {
  const Eigen::Matrix3d turned = rotation.toRotationMatrix();
  columns = {ToVec4(turned.col(0)), ToVec4(turned.col(1)), ToVec4(turned.col(2))};
}

MovingSurface::MovingSurface(const FloatCollider& collider, const RigidMotion& motion,
                             double substep_s)
    : collider_(&collider),
      motion_(motion),
      substep_s_(substep_s),
      pivot_(ToVec4(motion.pivot_m)),
      start_(motion.position_m, motion.rotation),
      end_(start_),
      velocity_(ToVec4(motion.velocity_m_per_s)),
      angular_velocity_(ToVec4(motion.angular_velocity_rad_per_s)),
      speed_(Length(velocity_)),
      turning_per_s_(Length(angular_velocity_)) {
  const ChordFactors chord = motion.ChordOver(substep_s);
  chord_sine_ = static_cast<float>(chord.sine);
  chord_cosine_ = static_cast<float>(chord.cosine_s);
  RigidMotion turning = motion;
  turning.rotation.setIdentity();
  turn_ = turning.After(substep_s).rotation;
  FindEnd();
}

void MovingSurface::Advance() {
  start_ = end_;
  ++substep_;
  FindEnd();
}

void MovingSurface::FindEnd() {
  const bool turns = turn_.vec() != Eigen::Vector3d::Zero();
  if (turns) motion_.rotation = (turn_ * motion_.rotation).normalized();
  const Eigen::Vector3d position_m =
      motion_.position_m + motion_.velocity_m_per_s * ((substep_ + 1) * substep_s_);
  if (turns) {
    end_ = {position_m, motion_.rotation};
  } else {
    end_.position = ToVec4(position_m);
  }
}

Gap MovingSurface::GapAt(const Pose& pose, Vec4 q) const {
  const Vec4 d = q - pose.position;
  const Vec4 described =
      pivot_ + Vec4{Dot(pose.columns[0], d), Dot(pose.columns[1], d), Dot(pose.columns[2], d), 0};
  const Gap gap = cpu::GapAt(*collider_, described);
  return {gap.gap, gap.normal[0] * pose.columns[0] + gap.normal[1] * pose.columns[1] +
                       gap.normal[2] * pose.columns[2]};
}

Vec4 MovingSurface::VelocityAtEnd(Vec4 place) const {
  return velocity_ + Cross(angular_velocity_, place - end_.position);
}

}  // namespace drape::cpu
