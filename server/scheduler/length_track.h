// Rest lengths of one cloth that change over time.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/scene/constraint_places.h"
#include "server/scene/scene_model.h"
#include "server/scheduler/track.h"

namespace drape {

// The lengths of the constraints of one cloth, in the order of the model. They are the model's
// until a request drives them; a cloth whose lengths are never driven costs nothing. Not
// thread-safe.
class LengthTrack {
 public:
  bool is_driven() const { return !track_.empty(); }
  // Every constraint begins at the length of `model`, which has at least one.
  void Start(const SceneModel& model);
  // The lengths are the model's again.
  void Stop() { *this = {}; }
  // The same motions for another model of the same constraints; its pins may leave out other
  // constraints than before.
  LengthTrack CarriedTo(const SceneModel& model) const;

  const Track<double>& track() const { return track_; }
  // Drives the constraints of `model`, at least one, by these motions.
  void Restore(const SceneModel& model, Track<double> track);

  // The index in the model of constraint `source` of the description; none if it is left out.
  std::optional<uint32_t> FindConstraint(const SceneModel& model, uint32_t source);
  // Constraint `index` of the model changes to `length_m` from its present length in `over_s`
  // seconds.
  void Move(uint32_t index, double length_m, double over_s, double now_s) {
    track_.Move(index, length_m, over_s, now_s);
  }
  // Every constraint changes to `scale` times the length of `model`.
  void Scale(const SceneModel& model, double scale, double over_s, double now_s);

  // The lengths themselves, not the targets (Motion::At).
  std::vector<double> LengthsAt(double time_s) const { return track_.At(time_s); }
  // See Track.
  void SendAgain() { track_.SendAgain(); }
  // Twice: the places are about as large.
  uint64_t held_bytes() const { return 2 * track_.held_bytes(); }
  bool is_settled() const { return track_.is_settled(); }
  // As StepItem::rest_lengths_m wants them; see Track.
  std::span<const double> TargetsForStep(double end_s) { return track_.TargetsForStep(end_s); }
  bool has_news() const { return track_.has_news(); }

 private:
  Track<double> track_;
  std::optional<ConstraintPlaces> places_;  // made when first needed
};

}  // namespace drape
