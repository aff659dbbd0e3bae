// The parts of one cloth that requests drive: its pins, grips, colliders and rest lengths.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <mutex>
#include <vector>

#include "server/scheduler/collider_track.h"
#include "server/scheduler/grip_track.h"
#include "server/scheduler/length_track.h"
#include "server/scheduler/track.h"
#include "server/solver/backend.h"

namespace drape {

using PinTrack = Track<Eigen::Vector3d>;  // [pin_count] in the order of the model

// In the cloth frame. Device thread, except CollidersAt.
class ClothControls {
 public:
  // Poses and velocities of the colliders at `time_s`; empty: they rest as described. Any thread.
  std::vector<RigidMotion> CollidersAt(double time_s) const;

  PinTrack& pins() { return pins_; }
  const PinTrack& pins() const { return pins_; }
  GripTrack& grips() { return grips_; }
  const GripTrack& grips() const { return grips_; }
  LengthTrack& lengths() { return lengths_; }
  const LengthTrack& lengths() const { return lengths_; }
  // Call ShowColliders after changing them.
  ColliderTrack& colliders() { return colliders_; }
  const ColliderTrack& colliders() const { return colliders_; }

  // All pins are at `starts_m` and go to `targets_m` in the step that begins at time 0; the rest
  // lengths are the model's; grips are open.
  void Reset(const std::vector<Eigen::Vector3d>& starts_m,
             const std::vector<Eigen::Vector3d>& targets_m);
  // The cloth has these colliders from now on, in motion or (empty) at rest about these pivots.
  void StartColliders(std::vector<RigidMotion> motions, std::vector<Eigen::Vector3d> pivots_m,
                      double now_s);
  // Takes over `track`, whose motions the backend already has.
  void SetColliders(ColliderTrack track);
  // Makes the changes to colliders() visible to CollidersAt.
  void ShowColliders();

  // The next step gets every target, even those that have not changed.
  void SendAgain() {
    pins_.SendAgain();
    lengths_.SendAgain();
  }
  // Whether nothing is known to change in the next step.
  bool are_at_rest() const {
    return pins_.is_settled() && lengths_.is_settled() && !colliders_.is_moving();
  }
  // The targets of a step between these times. Valid until the next call.
  void SetTargets(double start_s, double end_s, StepItem& item);
  // Whether that step moves something that the one before left where it was. Not colliders.
  bool has_news() const { return pins_.has_news() || lengths_.has_news() || grips_.has_changed(); }

 private:
  PinTrack pins_;
  GripTrack grips_;
  LengthTrack lengths_;
  ColliderTrack colliders_;
  mutable std::mutex mutex_;
  std::shared_ptr<const ColliderTrack> shown_colliders_;  // null: they rest; guarded by mutex_
};

}  // namespace drape
