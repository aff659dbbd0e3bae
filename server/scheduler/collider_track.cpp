#include "server/scheduler/collider_track.h"

#include <utility>

#include "server/core/check.h"

namespace drape {

RigidMotion ColliderTrack::Motion::At(double time_s) const {
  if (IsOver(time_s)) return *goal;
  const double seconds = time_s - start_s;
  if (seconds <= 0) return start;
  if (!goal) return start.After(seconds);
  return start.Towards(*goal, over_s).After(seconds);
}

void ColliderTrack::Rest(std::vector<Eigen::Vector3d> pivots_m) {
  pivots_m_ = std::move(pivots_m);
  motions_.clear();
}

void ColliderTrack::Start(std::vector<RigidMotion> motions, double start_s) {
  DRAPE_CHECK(!motions.empty(), "there is nothing to move");
  pivots_m_.clear();
  motions_.clear();
  for (RigidMotion& motion : motions) motions_.push_back({std::move(motion), {}, start_s, 0});
}

void ColliderTrack::BeginMoving(double now_s) {
  if (is_moving()) return;
  std::vector<RigidMotion> at_rest;
  for (const Eigen::Vector3d& pivot_m : pivots_m_) at_rest.push_back(RigidMotion::AtRest(pivot_m));
  Start(std::move(at_rest), now_s);
}

void ColliderTrack::Move(size_t collider, const ColliderTarget& target, double over_s,
                         double now_s) {
  DRAPE_CHECK(collider < motions_.size(), "no such collider");
  Motion& motion = motions_[collider];
  // Not where a motion that is to be over within one step would be at its end.
  RigidMotion start = now_s <= motion.start_s ? motion.start : motion.At(now_s);
  start.velocity_m_per_s.setZero();
  start.angular_velocity_rad_per_s.setZero();
  RigidMotion goal = start;
  goal.position_m = target.position_m;
  goal.rotation = target.rotation;
  motion = {start, goal, now_s, over_s};
}

std::span<const RigidMotion> ColliderTrack::MotionsForStep(double start_s, double end_s) {
  of_step_.clear();
  for (const Motion& motion : motions_) {
    const bool is_at_start = start_s <= motion.start_s;
    const RigidMotion start = is_at_start ? motion.start : motion.At(start_s);
    const bool is_on_its_way = motion.goal && (is_at_start || !motion.IsOver(start_s));
    // What is over within the step ends exactly there.
    of_step_.push_back(is_on_its_way ? start.Towards(motion.At(end_s), end_s - start_s) : start);
  }
  return of_step_;
}

std::vector<RigidMotion> ColliderTrack::At(double time_s) const {
  std::vector<RigidMotion> motions;
  for (const Motion& motion : motions_) {
    motions.push_back(time_s <= motion.start_s ? motion.start : motion.At(time_s));
  }
  return motions;
}

}  // namespace drape
