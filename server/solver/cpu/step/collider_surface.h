// A moving collider during one substep: gap and normal where it is, and how its surface moves. The
// counterpart of RestingSurface.
#pragma once

#include <array>

#include "server/scene/rigid_motion.h"
#include "server/solver/cpu/formulas/constraint_math.h"
#include "server/solver/cpu/model/float_controls.h"

namespace drape::cpu {

class MovingSurface {
 public:
  static constexpr bool kMoves = true;

  // `motion` as at the start of the step; the substep lasts from `begin_s` to `end_s` of the step.
  MovingSurface(const FloatCollider& collider, const RigidMotion& motion, double begin_s,
                double end_s);

  Gap GapAtStart(Vec4 p) const { return GapAt(start_, p); }
  Gap GapAtEnd(Vec4 q) const { return GapAt(end_, q); }
  // Of the gap at q [m].
  float RoundOff(Vec4 q) const;
  // Velocity of the point of the collider that is at `place` then [m/s].
  Vec4 VelocityAtStart(Vec4 place) const { return VelocityAt(start_, place); }
  Vec4 VelocityAtEnd(Vec4 place) const { return VelocityAt(end_, place); }
  // Over the substep, of the point that is at `place` when it starts [m/s].
  Vec4 MeanVelocity(Vec4 place) const;
  // Where it goes in the substep [m].
  Vec4 WayOf(Vec4 place) const { return duration_ * MeanVelocity(place); }

 private:
  // A point q lies in the description at pivot + R^T (q - position).
  struct Pose {
    explicit Pose(const RigidMotion& motion);

    Vec4 position;
    std::array<Vec4, 3> columns;  // of R
  };

  Gap GapAt(const Pose& pose, Vec4 q) const;
  Vec4 VelocityAt(const Pose& pose, Vec4 place) const;

  const FloatCollider* collider_;
  Vec4 pivot_;
  Pose start_;
  Pose end_;
  float duration_;  // [s]
  Vec4 velocity_;
  Vec4 angular_velocity_;
  float chord_sine_;
  float chord_cosine_;  // [s]
};

}  // namespace drape::cpu
