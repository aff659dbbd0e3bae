#include "server/scheduler/collider_track.h"

#include <utility>

#include "server/core/check.h"

namespace drape {

void ColliderTrack::Rest(std::vector<Eigen::Vector3d> pivots_m) {
  pivots_m_ = std::move(pivots_m);
  track_ = {};
}

void ColliderTrack::Start(std::vector<RigidMotion> motions, double start_s) {
  DRAPE_CHECK(!motions.empty(), "there is nothing to move");
  pivots_m_.clear();
  std::vector<Motion<RigidMotion>> endless;
  for (RigidMotion& motion : motions) endless.push_back({std::move(motion), {}, start_s, 0});
  track_.Start(std::move(endless), false);
}

void ColliderTrack::Restore(Track<RigidMotion> track) {
  DRAPE_CHECK(!track.empty(), "there is nothing to move");
  pivots_m_.clear();
  track_ = std::move(track);
}

void ColliderTrack::BeginMoving(double now_s) {
  if (is_moving()) return;
  std::vector<RigidMotion> at_rest;
  for (const Eigen::Vector3d& pivot_m : pivots_m_) at_rest.push_back(RigidMotion::AtRest(pivot_m));
  Start(std::move(at_rest), now_s);
}

void ColliderTrack::Move(size_t collider, const ColliderTarget& target, double over_s,
                         double now_s) {
  RigidMotion start = track_.motion(collider).At(now_s);
  start.velocity_m_per_s.setZero();
  start.angular_velocity_rad_per_s.setZero();
  RigidMotion goal = start;
  goal.position_m = target.position_m;
  goal.rotation = target.rotation;
  track_.Set(collider, {start, goal, now_s, over_s});
}

void ColliderTrack::Follow(size_t collider, const RigidMotion& motion, double now_s) {
  track_.Set(collider, {motion, {}, now_s, 0});
}

std::span<const RigidMotion> ColliderTrack::MotionsForStep(double start_s, double end_s) {
  of_step_.clear();
  for (size_t k = 0; k < track_.size(); ++k) {
    const Motion<RigidMotion>& motion = track_.motion(k);
    const RigidMotion start = motion.At(start_s);
    const bool is_on_its_way =
        motion.goal.has_value() && (start_s <= motion.start_s || !motion.IsOver(start_s));
    // A motion that is over within the step ends exactly there.
    of_step_.push_back(is_on_its_way ? start.Towards(motion.TargetAt(end_s), end_s - start_s)
                                     : start);
  }
  return of_step_;
}

}  // namespace drape
