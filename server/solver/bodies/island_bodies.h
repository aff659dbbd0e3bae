// The bodies that touch or hang together, as a ContactProblem counts them.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "server/solver/bodies/body_joints.h"
#include "server/solver/bodies/contact_problem.h"
#include "server/solver/bodies/momentum.h"
#include "server/solver/bodies/placed_collider.h"

namespace drape::bodies {

class IslandBodies {
 public:
  // `placed` outlives it. Shifts turn bodies from the poses at the end of the substep.
  IslandBodies(const std::vector<PlacedCollider>& placed, When when)
      : placed_(placed), when_(when) {}

  // Adds what an impulse does to collider c, if that is a body: it gets `push` times the impulse,
  // at `arm_m` from its centre. Of a contact the solid gets the impulse, the other its opposite.
  void AddSide(ProblemSides& its, size_t c, const Eigen::Vector3d& arm_m,
               const Eigen::Matrix3d& push);
  ProblemSides SidesOf(const BodyJoints::Joint& joint);

  const std::vector<size_t>& colliders() const { return colliders_; }  // of each body
  // root times its transpose is the inverse inertia of body b.
  const Eigen::Matrix3d& root(size_t b) const { return roots_[b]; }

 private:
  const std::vector<PlacedCollider>& placed_;
  When when_;
  std::vector<size_t> colliders_;
  std::vector<Eigen::Matrix3d> roots_;
};

}  // namespace drape::bodies
