#include "server/solver/cpu/step/collider_surface.h"

#include "server/solver/cpu/step/collider_gap.h"

namespace drape::cpu {
namespace {

Vec4 Cross(Vec4 a, Vec4 b) {
  return Vec4{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0};
}

}  // namespace

MovingSurface::Pose::Pose(const RigidMotion& motion) : position(ToVec4(motion.position_m)) {
  const Eigen::Matrix3d rotation = motion.rotation.toRotationMatrix();
  columns = {ToVec4(rotation.col(0)), ToVec4(rotation.col(1)), ToVec4(rotation.col(2))};
}

MovingSurface::MovingSurface(const FloatCollider& collider, const RigidMotion& motion,
                             double begin_s, double end_s)
    : collider_(&collider),
      pivot_(ToVec4(motion.pivot_m)),
      start_(motion.After(begin_s)),
      end_(motion.After(end_s)),
      duration_(static_cast<float>(end_s - begin_s)),
      velocity_(ToVec4(motion.velocity_m_per_s)),
      angular_velocity_(ToVec4(motion.angular_velocity_rad_per_s)) {
  const ChordFactors chord = motion.ChordOver(end_s - begin_s);
  chord_sine_ = static_cast<float>(chord.sine);
  chord_cosine_ = static_cast<float>(chord.cosine_s);
}

Gap MovingSurface::GapAt(const Pose& pose, Vec4 q) const {
  const Vec4 d = q - pose.position;
  const Vec4 described =
      pivot_ + Vec4{Dot(pose.columns[0], d), Dot(pose.columns[1], d), Dot(pose.columns[2], d), 0};
  const Gap gap = cpu::GapAt(*collider_, described);
  return {gap.gap, gap.normal[0] * pose.columns[0] + gap.normal[1] * pose.columns[1] +
                       gap.normal[2] * pose.columns[2]};
}

float MovingSurface::RoundOff(Vec4 q) const {
  const float of_frame =
      HWY_NAMESPACE::SumOfSizes(end_.position) + HWY_NAMESPACE::SumOfSizes(pivot_);
  return kTouchRoundOff * (HWY_NAMESPACE::SumOfSizes(q) + (of_frame + collider_->size));
}

Vec4 MovingSurface::VelocityAt(const Pose& pose, Vec4 place) const {
  return velocity_ + Cross(angular_velocity_, place - pose.position);
}

// v + (R r - r)/h for r from the position of the pivot, without the difference: with a = |w| h,
// sin(a)/a w x r + h (1 - cos(a))/a^2 w x (w x r).
Vec4 MovingSurface::MeanVelocity(Vec4 place) const {
  const Vec4 tangent = Cross(angular_velocity_, place - start_.position);
  return velocity_ + chord_sine_ * tangent + chord_cosine_ * Cross(angular_velocity_, tangent);
}

}  // namespace drape::cpu
