// A moving collider during one substep: gap and normal where it is, and how its surface moves. What
// FloatCollider is for colliders that rest.
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

  Gap GapAtStart(Lanes p) const { return GapAt(start_, p); }
  Gap GapAtEnd(Lanes q) const { return GapAt(end_, q); }
  // Of the point of the collider that is at `place` then [m/s].
  Lanes VelocityAtStart(Lanes place) const { return VelocityAt(start_, place); }
  Lanes VelocityAtEnd(Lanes place) const { return VelocityAt(end_, place); }
  // Over the substep, of the point that is at `place` when it starts [m/s].
  Lanes MeanVelocity(Lanes place) const;

 private:
  // A point q lies in the description at pivot + R^T (q - position).
  struct Pose {
    explicit Pose(const RigidMotion& motion);

    Lanes position;
    std::array<Lanes, 3> columns;  // of R
  };

  Gap GapAt(const Pose& pose, Lanes q) const;
  Lanes VelocityAt(const Pose& pose, Lanes place) const;

  const FloatCollider* collider_;
  Lanes pivot_;
  Pose start_;
  Pose end_;
  Lanes velocity_;
  Lanes angular_velocity_;
  float chord_sine_;
  float chord_cosine_;  // [s]
};

}  // namespace drape::cpu
