// Point joints and ropes of bodies: where they are, and what they demand (server/solver/method.md,
// "Bodies"). PatchContacts finds their impulses together with those of contacts.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "server/scene/body_joint.h"
#include "server/scene/rigid_motion.h"
#include "server/solver/bodies/momentum.h"
#include "server/solver/bodies/placed_collider.h"

namespace drape::bodies {

class BodyJoints {
 public:
  // Of what the joint acts on. Its impulse is three numbers: on the body of a point joint, or the
  // pull of a rope and nothing else.
  struct End {
    std::optional<size_t> collider;  // none: the environment
    Eigen::Vector3d at_start_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d at_end_m = Eigen::Vector3d::Zero();  // of the substep
    // Where the impulse acts, from the centre, and how: `push` times that of the joint.
    Eigen::Vector3d arm_m = Eigen::Vector3d::Zero();
    Eigen::Matrix3d push = Eigen::Matrix3d::Zero();
    Momentum given;  // as it is applied now
  };
  struct Joint {
    const BodyJoint* described = nullptr;
    std::array<End, 2> ends;  // the body's own first
    bool acts = false;        // a rope that is slack does not
    // Of the body's end over the other one, or what a rope has left in x; and what may be left.
    Eigen::Vector3d gap_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d floor_m = Eigen::Vector3d::Zero();
    // What VelocityOf must become.
    Eigen::Vector3d demanded_m_per_s = Eigen::Vector3d::Zero();
    Eigen::Vector3d impulse = Eigen::Vector3d::Zero();  // [N s]
    // What was found last, of this substep or the one before, for kSubstep and kEnd: the solver
    // starts there.
    std::array<Eigen::Vector3d, 2> guesses{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  };

  // Those of all colliders, which outlive it.
  explicit BodyJoints(const std::vector<PlacedCollider>& placed);

  std::span<const Joint> joints() const { return joints_; }
  // Whether a point joint ties the two to each other. They do not touch then: what turns about a
  // point inside both would stick.
  bool AreTied(size_t a, size_t b) const;

  // A substep of `seconds` begins: no impulse acts. Those of the substep act where it starts, which
  // keeps energy.
  void Begin(const std::vector<PlacedCollider>& placed, double seconds);
  // Where joints are at the end of the substep. Returns whether one is off its floor, or a rope
  // with something left pulls.
  bool Look(const std::vector<PlacedCollider>& placed, When when);
  // From the velocities of the moment, with the impulses that act. Drops those of slack ropes.
  void FindDemands(const std::vector<PlacedCollider>& placed, When when);
  // Of the ends towards each other, at the moment; of a rope in x, at which it gets slack [m/s].
  Eigen::Vector3d VelocityOf(const std::vector<PlacedCollider>& placed, const Joint& joint) const;

  void DropImpulses();
  void SetImpulse(size_t j, const Eigen::Vector3d& impulse, When when);
  // Of all impulses at the present arms.
  void FindMoments();
  // Adds what acts, [collider_count].
  void AddTo(std::vector<Momentum>& sums) const;

 private:
  void SetFloor(Joint& joint) const;
  // Of the places where the substep begins or ends, from the centres that the colliders have then.
  void SetArms(const std::vector<PlacedCollider>& placed, Joint& joint, When when) const;

  std::vector<Joint> joints_;
  double seconds_ = 0;
};

}  // namespace drape::bodies
