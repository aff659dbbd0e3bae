// A moving collider during one substep: gap and normal where it is, and how its surface moves. The
// counterpart of RestingSurface.
#pragma once

#include <cstdint>

#include "server/scene/rigid_motion.h"
#include "server/solver/cpu/formulas/constraint_math.h"
#include "server/solver/cpu/model/float_controls.h"

namespace drape::cpu {

class MovingSurface {
 public:
  // Where `motion` has it now.
  MovingSurface(const FloatCollider& collider, const RigidMotion& motion)
      : MovingSurface(collider, motion, 0) {}
  // During the first substep of a step of substeps of equal duration; `motion` as at its start.
  MovingSurface(const FloatCollider& collider, const RigidMotion& motion, double substep_s);
  // To the next substep.
  void Advance();

  Gap GapAtStart(Vec4 p) const;
  Gap GapAtEnd(Vec4 q) const;
  // Velocity of the point of the collider that is at `place` when the substep ends [m/s].
  Vec4 VelocityAtEnd(Vec4 place) const;

  struct Pose {
    Vec4 position;     // of the pivot [m]
    FloatPlace place;  // so contacts are those of a collider that rests there
  };
  const FloatCollider& collider() const { return *collider_; }
  const Pose& start() const { return start_; }
  const Pose& end() const { return end_; }
  const Vec4& velocity() const { return velocity_; }
  const Vec4& angular_velocity() const { return angular_velocity_; }
  // ChordFactors over the substep.
  float chord_sine() const { return chord_sine_; }
  float chord_cosine() const { return chord_cosine_; }
  float speed() const { return speed_; }                  // of the pivot [m/s]
  float turning_per_s() const { return turning_per_s_; }  // [rad/s]
  // The substep, from the start of the step [s].
  float start_s() const { return static_cast<float>(substep_ * substep_s_); }
  float end_s() const { return static_cast<float>((substep_ + 1) * substep_s_); }

 private:
  void FindEnd();
  // With the rotation of motion_, where its pivot is there.
  Pose PoseAt(const Eigen::Vector3d& position_m) const;
  Vec4 PointAt(const Eigen::Vector3d& position_m) const;

  const FloatCollider* collider_;
  RigidMotion motion_;       // as at the start of the step, but turned as at the end of the substep
  Eigen::Quaterniond turn_;  // of a substep
  double substep_s_;
  uint32_t substep_ = 0;
  Pose start_;
  Pose end_;
  Vec4 velocity_;
  Vec4 angular_velocity_;
  float chord_sine_;
  float chord_cosine_;  // [s]
  float speed_;
  float turning_per_s_;
};

}  // namespace drape::cpu
