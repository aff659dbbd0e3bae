#include "server/scheduler/active_request.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <unordered_map>
#include <utility>

#include "server/core/check.h"
#include "server/scene/constraint_places.h"

namespace drape {
namespace {

Status StepMismatch(const ClothRuntime& cloth, uint32_t cloth_index, const std::string& wanted) {
  return {StatusCode::kFailedPrecondition, "STEP_MISMATCH",
          "cloth " + std::to_string(cloth_index) + " of the request has completed " +
              std::to_string(cloth.now().completed_steps) + " steps, " + wanted};
}

// A cloth gets lengths of its own, which are those it has, when the first one is driven.
Status BeginDriving(Backend& backend, ClothRuntime& cloth) {
  if (cloth.lengths().is_driven() || cloth.model()->constraint_count() == 0) return Status::Ok();
  LengthTrack track;
  track.Start(*cloth.model());
  ClothUpdate update;
  update.rest_lengths_m = track.LengthsAt(cloth.now().time_s);
  DRAPE_RETURN_IF_ERROR(backend.Write(cloth.handle(), update));
  cloth.lengths() = std::move(track);
  return Status::Ok();
}

// Colliders that rested become ones that move, without moving yet.
Status BeginMoving(Backend& backend, ClothRuntime& cloth) {
  if (cloth.colliders().is_moving()) return Status::Ok();
  ColliderTrack track = cloth.colliders();
  const double now_s = cloth.now().time_s;
  track.BeginMoving(now_s);
  ClothUpdate update;
  update.collider_motions = track.At(now_s);
  DRAPE_RETURN_IF_ERROR(backend.Write(cloth.handle(), update));
  cloth.SetColliders(std::move(track));
  return Status::Ok();
}

}  // namespace

ActiveRequest::ActiveRequest(StepWork work, int64_t submitted_us, uint32_t tenant, uint64_t round)
    : work_(std::move(work)), tenant_(tenant), last_round_(round), idle_since_us_(submitted_us) {
  DRAPE_CHECK(!work_.cloths.empty(), "a step request needs a cloth");
  DRAPE_CHECK(work_.steps.has_value() != work_.until_step.has_value(),
              "exactly one of steps and until_step");
}

void ActiveRequest::EnterTurns() {
  for (const auto& cloth : work_.cloths) {
    std::deque<ActiveRequest*>& turns = cloth->turns();
    DRAPE_CHECK(turns.empty() || turns.back() != this, "a cloth occurs once in a request");
    missing_turns_ += !turns.empty();
    turns.push_back(this);
  }
}

void ActiveRequest::LeaveTurns() {
  for (const auto& cloth : work_.cloths) {
    std::deque<ActiveRequest*>& turns = cloth->turns();
    const bool had_the_turn = turns.front() == this;
    turns.erase(std::find(turns.begin(), turns.end(), this));
    if (had_the_turn && !turns.empty()) --turns.front()->missing_turns_;
  }
}

void ActiveRequest::EndWith(const Status& status) {
  if (!end_status_.has_value()) end_status_ = status;
}

Status ActiveRequest::CheckExpectations(uint32_t max_steps) const {
  for (uint32_t k = 0; k < work_.cloths.size(); ++k) {
    const ClothRuntime& cloth = *work_.cloths[k];
    if (!cloth.is_alive()) {
      return {StatusCode::kNotFound, "CLOTH_NOT_FOUND",
              "cloth " + std::to_string(k) + " of the request was deleted"};
    }
    if (cloth.is_faulted()) continue;
    const uint64_t completed = cloth.now().completed_steps;
    if (work_.expected_step.has_value() && completed != *work_.expected_step) {
      return StepMismatch(cloth, k, "expected_step is " + std::to_string(*work_.expected_step));
    }
    if (!work_.until_step.has_value()) continue;
    if (completed > *work_.until_step) {
      return StepMismatch(cloth, k, "beyond until_step " + std::to_string(*work_.until_step));
    }
    if (*work_.until_step - completed > max_steps) {
      return Status::InvalidField(
          "until_step", "at most " + std::to_string(max_steps) + " steps ahead of every cloth");
    }
  }
  return Status::Ok();
}

Status ActiveRequest::FindPins(std::vector<size_t>& pins) const {
  for (const PinControl& control : work_.pin_controls) {
    const auto model_pins = work_.cloths[control.cloth_index]->model()->pins();
    const auto found = std::lower_bound(model_pins.begin(), model_pins.end(), control.particle);
    if (found == model_pins.end() || *found != control.particle) {
      return {StatusCode::kFailedPrecondition, "PIN_NOT_FOUND",
              "particle " + std::to_string(control.particle) + " of cloth " +
                  std::to_string(control.cloth_index) + " of the request is no longer pinned"};
    }
    pins.push_back(static_cast<size_t>(found - model_pins.begin()));
  }
  return Status::Ok();
}

void ActiveRequest::ApplyPinControls(const std::vector<size_t>& pins) {
  for (size_t r = 0; r < pins.size(); ++r) {
    const PinControl& control = work_.pin_controls[r];
    ClothRuntime& cloth = *work_.cloths[control.cloth_index];
    cloth.pins().Move(pins[r], control.target_m, control.over_s, cloth.now().time_s);
  }
}

Status ActiveRequest::CheckLengthControls() const {
  std::unordered_map<uint32_t, ConstraintPlaces> places;  // by cloth
  for (const LengthControl& control : work_.length_controls) {
    const SceneModel& model = *work_.cloths[control.cloth_index]->model();
    const ConstraintPlaces& of_cloth = places.try_emplace(control.cloth_index, model).first->second;
    if (of_cloth.Find(control.constraint).has_value()) continue;
    return {StatusCode::kFailedPrecondition, "CONSTRAINT_NOT_FOUND",
            "cloth " + std::to_string(control.cloth_index) +
                " of the request no longer has the constraint " +
                std::to_string(control.constraint)};
  }
  return Status::Ok();
}

Status ActiveRequest::CheckColliderControls() const {
  for (const ColliderControl& control : work_.collider_controls) {
    const size_t count = work_.cloths[control.cloth_index]->colliders().collider_count();
    if (control.collider < count) continue;
    return {StatusCode::kFailedPrecondition, "COLLIDER_NOT_FOUND",
            "cloth " + std::to_string(control.cloth_index) +
                " of the request no longer has the collider " + std::to_string(control.collider)};
  }
  return Status::Ok();
}

void ActiveRequest::ApplyColliderControls() {
  std::map<uint32_t, ColliderTrack> tracks;  // by cloth
  for (const ColliderControl& control : work_.collider_controls) {
    const ClothRuntime& cloth = *work_.cloths[control.cloth_index];
    ColliderTrack& track = tracks.try_emplace(control.cloth_index, cloth.colliders()).first->second;
    track.Move(control.collider, control.target, control.over_s, cloth.now().time_s);
  }
  for (auto& [index, track] : tracks) work_.cloths[index]->SetColliders(std::move(track));
}

Status ActiveRequest::ApplyLengthControls(Backend& backend) {
  for (const LengthScale& control : work_.length_scales) {
    DRAPE_RETURN_IF_ERROR(BeginDriving(backend, *work_.cloths[control.cloth_index]));
  }
  for (const LengthControl& control : work_.length_controls) {
    DRAPE_RETURN_IF_ERROR(BeginDriving(backend, *work_.cloths[control.cloth_index]));
  }
  for (const LengthScale& control : work_.length_scales) {
    ClothRuntime& cloth = *work_.cloths[control.cloth_index];
    if (!cloth.lengths().is_driven()) continue;  // without constraints
    cloth.lengths().Scale(*cloth.model(), control.scale, control.over_s, cloth.now().time_s);
  }
  for (const LengthControl& control : work_.length_controls) {
    ClothRuntime& cloth = *work_.cloths[control.cloth_index];
    const std::optional<uint32_t> place = cloth.lengths().PlaceOf(control.constraint);
    DRAPE_CHECK(place.has_value(), "checked before");
    cloth.lengths().Move(*place, control.length_m, control.over_s, cloth.now().time_s);
  }
  return Status::Ok();
}

Status ActiveRequest::Start(Backend& backend, uint32_t max_steps) {
  DRAPE_CHECK(has_every_turn() && !has_started_, "a request starts once, when it has every turn");
  DRAPE_RETURN_IF_ERROR(CheckExpectations(max_steps));
  std::vector<size_t> pins;
  DRAPE_RETURN_IF_ERROR(FindPins(pins));
  DRAPE_RETURN_IF_ERROR(CheckLengthControls());
  DRAPE_RETURN_IF_ERROR(CheckColliderControls());
  for (const ColliderControl& control : work_.collider_controls) {
    DRAPE_RETURN_IF_ERROR(BeginMoving(backend, *work_.cloths[control.cloth_index]));
  }
  DRAPE_RETURN_IF_ERROR(ApplyLengthControls(backend));
  ApplyPinControls(pins);
  ApplyColliderControls();
  has_started_ = true;
  steps_left_.resize(work_.cloths.size());
  if (work_.report) reports_.resize(work_.cloths.size());
  for (size_t k = 0; k < work_.cloths.size(); ++k) {
    const ClothRuntime& cloth = *work_.cloths[k];
    if (cloth.is_faulted()) {
      // Stepping leaves a faulted cloth as it is; once, for its report.
      steps_left_[k] = work_.report ? 1 : 0;
    } else if (work_.steps.has_value()) {
      steps_left_[k] = *work_.steps;
    } else {
      steps_left_[k] = static_cast<uint32_t>(*work_.until_step - cloth.now().completed_steps);
    }
    cloths_to_step_ += steps_left_[k] > 0;
  }
  return Status::Ok();
}

std::span<const uint32_t> ActiveRequest::Places(double solves_per_place) {
  constexpr double kMost = std::numeric_limits<uint32_t>::max();
  places_.clear();
  const size_t count = steps_left_.size();
  for (size_t n = 0; n < count; ++n) {
    const size_t k = (cursor_ + n) % count;
    if (steps_left_[k] == 0) continue;
    const double places = std::ceil(work_.cloths[k]->solves_per_step() / solves_per_place);
    places_.push_back(static_cast<uint32_t>(std::clamp(places, 1.0, kMost)));
  }
  return places_;
}

std::vector<uint32_t> ActiveRequest::Take(uint32_t count, uint64_t round) {
  DRAPE_CHECK(count <= cloths_to_step_, "a request has no more cloths to step");
  std::vector<uint32_t> taken;
  taken.reserve(count);
  while (taken.size() < count) {
    if (steps_left_[cursor_] > 0) taken.push_back(cursor_);
    cursor_ = (cursor_ + 1) % static_cast<uint32_t>(steps_left_.size());
  }
  last_round_ = round;
  return taken;
}

bool ActiveRequest::IsMeasured(uint32_t cloth_index) const {
  return work_.report && steps_left_[cloth_index] == 1;
}

void ActiveRequest::CompleteStep(uint32_t cloth_index, const StepReport& report) {
  const ClothRuntime& cloth = *work_.cloths[cloth_index];
  const bool is_measured = IsMeasured(cloth_index);
  uint32_t& left = steps_left_[cloth_index];
  left -= 1;
  if (is_measured) {
    reports_[cloth_index] = cloth.Shifted(report);
  } else if (report.fault != FaultReason::kNone) {
    left = work_.report ? 1 : 0;  // once more for the report, see Start
  }
  cloths_to_step_ -= left == 0;
}

void ActiveRequest::AddBatch(const BatchReport& batch, uint32_t cloths, uint32_t requests,
                             int64_t begin_us, int64_t end_us) {
  timing_.queue_us += begin_us - idle_since_us_;
  timing_.upload_us += batch.upload_us;
  timing_.device_us += batch.device_us;
  timing_.readback_us += batch.readback_us;
  timing_.batch_cloths = cloths;
  timing_.batch_requests = requests;
  timing_.batch_dispatches = batch.dispatch_count;
  idle_since_us_ = end_us;
}

StepOutcome ActiveRequest::Outcome() const {
  StepOutcome outcome;
  if (end_status_.has_value()) {
    outcome.status = *end_status_;
    return outcome;
  }
  outcome.timing = timing_;
  outcome.cloths.resize(work_.cloths.size());
  for (size_t k = 0; k < work_.cloths.size(); ++k) {
    outcome.cloths[k].stamp = StampOf(*work_.cloths[k]);
    outcome.cloths[k].warnings = work_.cloths[k]->now().warnings;
    if (work_.report) outcome.cloths[k].report = reports_[k];
  }
  return outcome;
}

}  // namespace drape
