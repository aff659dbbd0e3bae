#include "server/scheduler/cloth_controls.h"

#include <utility>

#include "server/core/check.h"

namespace drape {

std::vector<RigidMotion> ClothControls::CollidersAt(double time_s) const {
  std::shared_ptr<const ColliderTrack> track;
  {
    const std::lock_guard lock(mutex_);
    track = shown_colliders_;
  }
  if (track == nullptr) return {};
  return track->At(time_s);
}

void ClothControls::Reset(const std::vector<Eigen::Vector3d>& starts_m,
                          const std::vector<Eigen::Vector3d>& targets_m) {
  DRAPE_CHECK(starts_m.size() == targets_m.size(), "one target per pin");
  std::vector<Motion<Eigen::Vector3d>> motions;
  motions.reserve(starts_m.size());
  for (size_t k = 0; k < starts_m.size(); ++k) {
    motions.push_back({starts_m[k], targets_m[k], 0, 0});
  }
  pins_.Start(std::move(motions), false);
  lengths_.Stop();
  grips_.Reset();
}

void ClothControls::StartColliders(std::vector<RigidMotion> motions,
                                   std::vector<Eigen::Vector3d> pivots_m, double now_s) {
  ColliderTrack track;
  if (motions.empty()) {
    track.Rest(std::move(pivots_m));
  } else {
    track.Start(std::move(motions), now_s);
  }
  SetColliders(std::move(track));
}

void ClothControls::SetColliders(ColliderTrack track) {
  colliders_ = std::move(track);
  ShowColliders();
}

void ClothControls::ShowColliders() {
  auto shown = colliders_.is_moving() ? std::make_shared<const ColliderTrack>(colliders_) : nullptr;
  const std::lock_guard lock(mutex_);
  shown_colliders_ = std::move(shown);
}

void ClothControls::SetTargets(double start_s, double end_s, StepItem& item) {
  item.pin_targets_m = pins_.TargetsForStep(end_s);
  item.grips = grips_.GripsForStep(end_s);
  item.rest_lengths_m = lengths_.TargetsForStep(end_s);
  item.collider_motions = colliders_.MotionsForStep(start_s, end_s);
}

}  // namespace drape
