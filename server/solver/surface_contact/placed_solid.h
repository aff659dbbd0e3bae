// A solid where it is during a substep, and how its surface moves.
#pragma once

#include <array>
#include <cstddef>

#include "server/scene/rigid_motion.h"
#include "server/solver/surface_contact/solid.h"

namespace drape::surface_contact {

template <class V>
class PlacedSolid {
 public:
  using Real = ScalarOf<V>;

  // `motion`: at the start of the step; null: it rests as described. `place`: what the owner calls
  // the collider.
  PlacedSolid(const Collider& collider, const RigidMotion* motion, double thickness_m,
              size_t place);

  // The substep under way lasts from `begin_s` to `end_s` of the step.
  void Place(double begin_s, double end_s);

  const Solid<V>& solid() const { return solid_; }
  size_t place() const { return place_; }
  bool moves() const { return moves_; }

  // In the frame of the description, when the substep starts and when it ends.
  V DescribedAtStart(const V& x) const { return moves_ ? Described(start_, x) : x; }
  V DescribedAtEnd(const V& x) const { return moves_ ? Described(end_, x) : x; }
  // A direction of that frame.
  V TurnedAtStart(const V& n) const { return moves_ ? Turned(start_, n) : n; }
  V TurnedAtEnd(const V& n) const { return moves_ ? Turned(end_, n) : n; }
  // Velocities of the point of the solid that is at `place` then [m/s].
  V VelocityAtStart(const V& place) const { return VelocityAt(start_, place); }
  V VelocityAtEnd(const V& place) const { return VelocityAt(end_, place); }
  // Of the point that is there when the substep starts, its way until the end [m].
  V WayOf(const V& place) const;
  // Where it turns about, when the substep ends [m].
  const V& pivot_at_end() const { return end_.position; }
  // Of its points that are no farther than `radius` from the pivot, at most [m/s].
  Real SpeedWithin(Real radius) const { return moves_ ? speed_ + turn_ * radius : 0; }
  Real FarthestFromPivot(const V& low, const V& high) const;

 private:
  struct Pose {
    V position{};
    std::array<V, 3> columns{};  // of the rotation
  };
  static Pose PoseOf(const RigidMotion& motion);
  V Described(const Pose& pose, const V& x) const;
  static V Turned(const Pose& pose, const V& n);
  V VelocityAt(const Pose& pose, const V& place) const;

  Solid<V> solid_;
  size_t place_;
  bool moves_;
  RigidMotion motion_;
  Real duration_ = 0;
  Pose start_, end_;
  V pivot_{};
  V velocity_{}, angular_velocity_{};
  Real speed_ = 0, turn_ = 0;
  Real chord_sine_ = 1, chord_cosine_ = 0;
};

extern template class PlacedSolid<self_contact::Vector3f>;
extern template class PlacedSolid<self_contact::Vector3d>;

}  // namespace drape::surface_contact
