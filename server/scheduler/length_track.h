// Rest lengths of one cloth that change over time.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/scene/constraint_places.h"
#include "server/scene/scene_model.h"

namespace drape {

// From `start_m` at start_s linearly to `target_m` at start_s + over_s; constant before and after.
struct LengthMotion {
  double start_m = 0;   // > 0
  double target_m = 0;  // > 0
  double start_s = 0;
  double over_s = 0;  // >= 0; 0 = within one step

  // At or after the end exactly target_m.
  double At(double time_s) const;
  bool IsOver(double time_s) const { return time_s >= start_s + over_s; }
};

// The lengths of the constraints of one cloth, which are the model's until the cloth is driven.
// Cloths that never are cost nothing. Not thread-safe.
class LengthTrack {
 public:
  bool is_driven() const { return !motions_.empty(); }
  // Every constraint begins at the length of `model`; needs a constraint.
  void Start(const SceneModel& model);
  // The lengths are the model's again.
  void Stop() { *this = {}; }
  // The same motions for another model of the same constraints, some of which it may leave out or
  // bring back (other pins).
  LengthTrack CarriedTo(const SceneModel& model) const;

  // Where constraint `source` of the description is in the model; none if the model leaves it out.
  // Needs is_driven().
  std::optional<uint32_t> PlaceOf(uint32_t source) const { return places_.Find(source); }
  // The constraint at `place` goes to `length_m` from what it is at now_s over `over_s` seconds.
  void Move(uint32_t place, double length_m, double over_s, double now_s);
  // Every constraint goes to `scale` times the length of `model`.
  void Scale(const SceneModel& model, double scale, double over_s, double now_s);

  // Of the constraints themselves, in the order of the model: at the start of a motion where it
  // starts, even if it is to be over within one step.
  std::vector<double> LengthsAt(double time_s) const;
  // What StepItem.rest_lengths_m wants for a step that ends at `end_s`: every length, or nothing
  // while none has changed since the last step. Valid until the next call.
  std::span<const double> TargetsForStep(double end_s);

 private:
  double LengthAt(uint32_t place, double time_s) const;

  std::vector<LengthMotion> motions_;  // [constraint_count] in the order of the model
  ConstraintPlaces places_;
  std::vector<double> targets_m_;
  bool is_settled_ = true;  // the backend has every final length
};

}  // namespace drape
