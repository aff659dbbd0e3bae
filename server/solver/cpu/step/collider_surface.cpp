#include "server/solver/cpu/step/collider_surface.h"

#include "server/solver/cpu/step/collider_gap.h"

namespace drape::cpu {
namespace {

Vec4 Cross(Vec4 a, Vec4 b) {
  return Vec4{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0};
}

}  // namespace

MovingSurface::MovingSurface(const FloatCollider& collider, const RigidMotion& motion,
                             double substep_s)
    : collider_(&collider),
      motion_(motion),
      substep_s_(substep_s),
      start_(PoseAt(motion.position_m)),
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
  const Eigen::Vector3d position_m =
      motion_.position_m + motion_.velocity_m_per_s * ((substep_ + 1) * substep_s_);
  if (turn_.vec() != Eigen::Vector3d::Zero()) {
    motion_.rotation = (turn_ * motion_.rotation).normalized();
    end_ = PoseAt(position_m);
  } else {
    end_.position = ToVec4(position_m);
    end_.place.point = PointAt(position_m);
  }
}

Vec4 MovingSurface::PointAt(const Eigen::Vector3d& position_m) const {
  const Eigen::Vector3d arm_m = ToVector3d(collider_->place.point) - motion_.pivot_m;
  return ToVec4(Eigen::Vector3d(position_m + motion_.rotation * arm_m));
}

// Each number is rounded once.
MovingSurface::Pose MovingSurface::PoseAt(const Eigen::Vector3d& position_m) const {
  const Eigen::Matrix3d rotation = motion_.rotation.toRotationMatrix();
  const auto turned = [&](Vec4 v) { return ToVec4(Eigen::Vector3d(rotation * ToVector3d(v))); };
  const FloatPlace& described = collider_->place;
  const bool is_direction =
      collider_->kind == ShapeKind::kPlane || collider_->kind == ShapeKind::kCapsule;
  return {ToVec4(position_m),
          {PointAt(position_m),
           is_direction ? turned(described.vector) : described.vector,
           {turned(described.axes[0]), turned(described.axes[1]), turned(described.axes[2])}}};
}

Gap MovingSurface::GapAtStart(Vec4 p) const {
  return GapAt(*collider_, start_.place, p);
}

Gap MovingSurface::GapAtEnd(Vec4 q) const {
  return GapAt(*collider_, end_.place, q);
}

Vec4 MovingSurface::VelocityAtEnd(Vec4 place) const {
  return velocity_ + Cross(angular_velocity_, place - end_.position);
}

}  // namespace drape::cpu
