// Where the pins of one cloth are and will be.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "server/scene/pin_motion.h"

namespace drape {

// The motions of the pins of one cloth, in the cloth frame; element k belongs to pin k of the
// model. Not thread-safe.
class PinTrack {
 public:
  // All pins are at `starts_m` and go to `targets_m` in the step that begins at `now_s`.
  void Start(std::vector<Eigen::Vector3d> starts_m, std::vector<Eigen::Vector3d> targets_m,
             double now_s);
  // One motion per pin.
  void Start(std::vector<PinMotion> motions);
  // Pin `pin` leaves for `target_m` at `now_s` from where it is then, in a straight line over
  // `over_s` seconds (0 = within one step).
  void Move(size_t pin, const Eigen::Vector3d& target_m, double over_s, double now_s);

  size_t pin_count() const { return motions_.size(); }
  const PinMotion& motion(size_t pin) const { return motions_[pin]; }
  // Where the pin itself is. Unlike PinMotion::At, which is about targets, at the start of a motion
  // this is where it starts, even if it is to be over within one step.
  Eigen::Vector3d At(size_t pin, double time_s) const {
    const PinMotion& motion = motions_[pin];
    return time_s <= motion.start_s ? motion.start_m : motion.At(time_s);
  }
  // What StepItem.pin_targets_m wants for a step that ends at `end_s`: every pin's target, or
  // nothing while no pin has moved since the targets of the last step. Valid until the next call.
  std::span<const Eigen::Vector3d> TargetsForStep(double end_s);

 private:
  std::vector<PinMotion> motions_;
  std::vector<Eigen::Vector3d> targets_m_;
  bool is_settled_ = true;  // the backend has every pin's final target
};

}  // namespace drape
