#include "server/scheduler/length_track.h"

#include <algorithm>

#include "server/core/check.h"

namespace drape {

double LengthMotion::At(double time_s) const {
  if (IsOver(time_s)) return target_m;
  if (time_s <= start_s) return start_m;
  return start_m + (target_m - start_m) * ((time_s - start_s) / over_s);
}

void LengthTrack::Start(const SceneModel& model) {
  DRAPE_CHECK(model.constraint_count() > 0, "there is nothing to drive");
  motions_.clear();
  for (const DistanceConstraint& constraint : model.constraints()) {
    motions_.push_back({constraint.rest_length_m, constraint.rest_length_m, 0, 0});
  }
  places_ = ConstraintPlaces(model);
  is_settled_ = true;
}

LengthTrack LengthTrack::CarriedTo(const SceneModel& model) const {
  LengthTrack carried;
  if (!is_driven() || model.constraint_count() == 0) return carried;
  carried.Start(model);
  for (uint32_t k = 0; k < model.constraint_count(); ++k) {
    const std::optional<uint32_t> place = PlaceOf(model.constraint_sources()[k]);
    if (place.has_value()) carried.motions_[k] = motions_[*place];
  }
  carried.is_settled_ = is_settled_;
  return carried;
}

void LengthTrack::Move(uint32_t place, double length_m, double over_s, double now_s) {
  DRAPE_CHECK(place < motions_.size(), "no such constraint");
  motions_[place] = {LengthAt(place, now_s), length_m, now_s, over_s};
  is_settled_ = false;
}

void LengthTrack::Scale(const SceneModel& model, double scale, double over_s, double now_s) {
  for (uint32_t k = 0; k < model.constraint_count(); ++k) {
    Move(k, model.constraints()[k].rest_length_m * scale, over_s, now_s);
  }
}

double LengthTrack::LengthAt(uint32_t place, double time_s) const {
  const LengthMotion& motion = motions_[place];
  return time_s <= motion.start_s ? motion.start_m : motion.At(time_s);
}

std::vector<double> LengthTrack::LengthsAt(double time_s) const {
  std::vector<double> lengths_m;
  lengths_m.reserve(motions_.size());
  for (uint32_t k = 0; k < motions_.size(); ++k) lengths_m.push_back(LengthAt(k, time_s));
  return lengths_m;
}

std::span<const double> LengthTrack::TargetsForStep(double end_s) {
  if (is_settled_) return {};
  targets_m_.clear();
  for (const LengthMotion& motion : motions_) targets_m_.push_back(motion.At(end_s));
  is_settled_ = std::all_of(motions_.begin(), motions_.end(),
                            [&](const LengthMotion& motion) { return motion.IsOver(end_s); });
  return targets_m_;
}

}  // namespace drape
