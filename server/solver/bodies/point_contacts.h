// Contacts of bodies with colliders and with each other.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "server/solver/bodies/body_numbers.h"
#include "server/solver/bodies/body_points.h"
#include "server/solver/bodies/placed_collider.h"
#include "server/solver/step_impulses.h"

namespace drape::bodies {

// The points of each solid (body_points.h) against the surface of each other one, where at least
// one of the two is a body. The thickness of the cloth has no part in it.
class PointContacts {
 public:
  explicit PointContacts(const std::vector<PlacedCollider>& placed);

  // A substep begins: rebounds, from how the bodies move before it.
  void Begin(const std::vector<PlacedCollider>& placed, const BodyNumbers& numbers, double seconds);
  // One sweep. Returns the largest change of a velocity of a body [m/s].
  double Solve(std::vector<PlacedCollider>& placed, const BodyNumbers& numbers);
  // At the end of the substep.
  void Correct(std::vector<PlacedCollider>& placed, const BodyNumbers& numbers);

  // What bodies gave to each collider so far, about its centre or pivot.
  const std::vector<ColliderImpulse>& given() const { return given_; }

 private:
  // A point of collider `solid` at the surface of collider `other`.
  struct Contact {
    size_t solid = 0;
    size_t other = 0;
    Eigen::Vector3d place_m;  // as described
    double radius_m = 0;
    // In the substep under way.
    double start_gap = 0;
    double rebound = 0;  // [m/s]
    double normal = 0;   // [N s], what pushes `solid` along the normal
    Eigen::Vector3d tangent = Eigen::Vector3d::Zero();
  };
  // Where the contact is, from the centres of both, and how.
  struct Touch {
    double gap = 0;
    Eigen::Vector3d n;
    Eigen::Vector3d arm_of_solid = Eigen::Vector3d::Zero();
    Eigen::Vector3d arm_of_other = Eigen::Vector3d::Zero();
  };

  Touch TouchAtEnd(const std::vector<PlacedCollider>& placed, const Contact& contact,
                   bool is_over) const;
  void Apply(std::vector<PlacedCollider>& placed, const Contact& contact, const Touch& touch,
             const Eigen::Vector3d& impulse);

  std::vector<Contact> contacts_;
  std::vector<ColliderImpulse> given_;  // [collider_count]
  double seconds_ = 0;
};

}  // namespace drape::bodies
