#include "server/scheduler/length_track.h"

#include <utility>

#include "server/core/check.h"

namespace drape {
namespace {

std::vector<Motion<double>> AtRest(const SceneModel& model) {
  std::vector<Motion<double>> motions;
  motions.reserve(model.constraint_count());
  for (const DistanceConstraint& constraint : model.constraints()) {
    motions.push_back({constraint.rest_length_m, constraint.rest_length_m, 0, 0});
  }
  return motions;
}

}  // namespace

void LengthTrack::Start(const SceneModel& model) {
  DRAPE_CHECK(model.constraint_count() > 0, "there is nothing to drive");
  track_.Start(AtRest(model), true);
  places_.emplace(model);
}

void LengthTrack::Restore(const SceneModel& model, Track<double> track) {
  DRAPE_CHECK(track.size() == model.constraint_count(), "one motion per constraint");
  track_ = std::move(track);
  places_.emplace(model);
}

LengthTrack LengthTrack::CarriedTo(const SceneModel& model) const {
  LengthTrack carried;
  if (!is_driven() || model.constraint_count() == 0) return carried;
  std::vector<Motion<double>> motions = AtRest(model);
  for (size_t k = 0; k < motions.size(); ++k) {
    const std::optional<uint32_t> index = places_->Find(model.constraint_sources()[k]);
    if (index.has_value()) motions[k] = track_.motion(*index);
  }
  carried.track_.Start(std::move(motions), track_.is_settled());
  carried.places_.emplace(model);
  return carried;
}

std::optional<uint32_t> LengthTrack::FindConstraint(const SceneModel& model, uint32_t source) {
  if (!places_.has_value()) places_.emplace(model);
  return places_->Find(source);
}

void LengthTrack::Scale(const SceneModel& model, double scale, double over_s, double now_s) {
  for (uint32_t k = 0; k < model.constraint_count(); ++k) {
    Move(k, model.constraints()[k].rest_length_m * scale, over_s, now_s);
  }
}

}  // namespace drape
