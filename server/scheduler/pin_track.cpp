#include "server/scheduler/pin_track.h"

#include <algorithm>
#include <utility>

#include "server/core/check.h"

namespace drape {

void PinTrack::Start(std::vector<Eigen::Vector3d> starts_m, std::vector<Eigen::Vector3d> targets_m,
                     double now_s) {
  DRAPE_CHECK(starts_m.size() == targets_m.size(), "one target per pin");
  std::vector<PinMotion> motions(starts_m.size());
  for (size_t k = 0; k < motions.size(); ++k) {
    motions[k] = {starts_m[k], targets_m[k], now_s, 0};
  }
  Start(std::move(motions));
}

void PinTrack::Start(std::vector<PinMotion> motions) {
  motions_ = std::move(motions);
  is_settled_ = motions_.empty();
}

void PinTrack::Move(size_t pin, const Eigen::Vector3d& target_m, double over_s, double now_s) {
  DRAPE_CHECK(pin < motions_.size(), "no such pin");
  // Nothing happens; the cloth may go on sleeping.
  if (is_settled_ && target_m == motions_[pin].target_m) return;
  motions_[pin] = {At(pin, now_s), target_m, now_s, over_s};
  is_settled_ = false;
}

std::span<const Eigen::Vector3d> PinTrack::TargetsForStep(double end_s) {
  if (is_settled_) return {};
  targets_m_.clear();
  for (const PinMotion& motion : motions_) targets_m_.push_back(motion.At(end_s));
  is_settled_ = std::all_of(motions_.begin(), motions_.end(),
                            [&](const PinMotion& motion) { return motion.IsOver(end_s); });
  return targets_m_;
}

}  // namespace drape
