// The poses of the colliders of one cloth over time.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <span>
#include <vector>

#include "server/scene/rigid_motion.h"
#include "server/scheduler/track.h"

namespace drape {

// The pose that a collider is sent to.
struct ColliderTarget {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();          // of the pivot
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // unit, from how it was described
};

// The motions of the colliders of one cloth, in the cloth frame. Colliders move by themselves
// (velocities of their description) until they are sent somewhere; there they rest. A cloth whose
// colliders never moved costs nothing. Not thread-safe.
class ColliderTrack {
 public:
  // All colliders rest as described. Once they are sent somewhere, they turn about these points.
  void Rest(std::vector<Eigen::Vector3d> pivots_m);
  // All colliders have these motions from `start_s` on; at least one.
  void Start(std::vector<RigidMotion> motions, double start_s);

  uint64_t held_bytes() const {
    return pivots_m_.size() * sizeof(Eigen::Vector3d) + track_.held_bytes();
  }
  size_t collider_count() const { return is_moving() ? track_.size() : pivots_m_.size(); }
  // Whether any collider moves, or may have moved away.
  bool is_moving() const { return !track_.empty(); }
  const Track<RigidMotion>& track() const { return track_; }
  // All colliders are driven by these motions; at least one.
  void Restore(Track<RigidMotion> track);
  // Move becomes possible; nothing moves yet.
  void BeginMoving(double now_s);
  // Needs is_moving(). Collider `collider` leaves for `target` at `now_s`, in a straight line and
  // turning about one axis, the shorter way, over `over_s` seconds (0 = within one step).
  void Move(size_t collider, const ColliderTarget& target, double over_s, double now_s);

  // Needs is_moving(). A step has moved body `collider` to this pose, with these velocities.
  void Follow(size_t collider, const RigidMotion& motion, double now_s);

  // As StepItem::collider_motions wants them for a step between these times: nothing unless
  // is_moving(). Valid until the next call.
  std::span<const RigidMotion> MotionsForStep(double start_s, double end_s);
  // Their poses and velocities at a time (Motion::At).
  std::vector<RigidMotion> At(double time_s) const { return track_.At(time_s); }

 private:
  std::vector<Eigen::Vector3d> pivots_m_;  // while they rest
  Track<RigidMotion> track_;
  std::vector<RigidMotion> of_step_;
};

}  // namespace drape
