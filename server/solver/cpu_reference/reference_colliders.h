// The colliders of one cloth while a substep lasts: where they are, and how their surfaces move.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "server/solver/bodies/bodies.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/cpu_reference/reference_contact.h"

namespace drape {

class ReferenceColliders {
 public:
  // Both must outlive it; `bodies` tell where they are.
  ReferenceColliders(const ClothParameters& parameters, const Bodies& bodies)
      : parameters_(parameters), bodies_(bodies) {}

  // The substep under way lasts from `begin_s` to `end_s` of the step.
  void Place(double begin_s, double end_s);

  size_t size() const { return parameters_.colliders.size(); }
  bool are_moving() const { return HasMovingColliders(parameters_); }
  bool IsBody(size_t c) const { return parameters_.colliders[c].is_body(); }
  // Gap and normal of collider c at a point, when the substep starts and when it ends.
  ReferenceContact AtStart(size_t c, const Eigen::Vector3d& p) const;
  ReferenceContact AtEnd(size_t c, const Eigen::Vector3d& q) const;
  // Where the pivot of collider c is when the substep ends [m].
  Eigen::Vector3d PivotAtEnd(size_t c) const;

  // Velocity of the point of collider c that is at `place` then [m/s].
  Eigen::Vector3d VelocityAtStart(size_t c, const Eigen::Vector3d& place) const;
  Eigen::Vector3d VelocityAtEnd(size_t c, const Eigen::Vector3d& place) const;
  // Over the substep, of the point that is at `place` when it starts [m/s].
  Eigen::Vector3d MeanVelocity(size_t c, const Eigen::Vector3d& place) const;

 private:
  const RigidMotion& StartOf(size_t c) const {
    return IsBody(c) ? bodies_.MotionAtStart(c) : at_start_[c];
  }
  const RigidMotion& EndOf(size_t c) const {
    return IsBody(c) ? bodies_.MotionAtEnd(c) : at_end_[c];
  }

  const ClothParameters& parameters_;
  const Bodies& bodies_;
  double duration_s_ = 0;
  std::vector<RigidMotion> at_start_;  // [collider_count], or empty: they rest as described
  std::vector<RigidMotion> at_end_;
};

}  // namespace drape
