#include "server/scheduler/active_request.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>

#include "server/core/check.h"
#include "server/core/trace.h"
#include "server/scheduler/grabbed_positions.h"

namespace drape {
namespace {

Status StepMismatch(const ClothRuntime& cloth, uint32_t cloth_index, const std::string& wanted) {
  return {StatusCode::kFailedPrecondition, "STEP_MISMATCH",
          "cloth " + std::to_string(cloth_index) + " of the request has completed " +
              std::to_string(cloth.now().completed_steps) + " steps, " + wanted};
}

// The index of the particle's pin in the model and in PinTrack.
std::optional<size_t> FindPin(const SceneModel& model, uint32_t particle) {
  const auto pins = model.pins();
  const auto found = std::lower_bound(pins.begin(), pins.end(), particle);
  if (found == pins.end() || *found != particle) return std::nullopt;
  return static_cast<size_t>(found - pins.begin());
}

Status NotFound(const char* reason, uint32_t cloth_index, const std::string& element) {
  return {StatusCode::kFailedPrecondition, reason,
          "cloth " + std::to_string(cloth_index) + " of the request no longer has " + element};
}

// Before its first step a request checks all its controls, then prepares all, then applies all. One
// overload per kind of control.

Status Check(ClothRuntime& cloth, const ClothControl<PinControl>& pin) {
  if (FindPin(*cloth.model(), pin.control.particle).has_value()) return Status::Ok();
  return NotFound(
      "PIN_NOT_FOUND", pin.cloth_index,
      "a pin at particle " + std::to_string(cloth.model()->DescribedOf(pin.control.particle)));
}

Status Check(ClothRuntime& cloth, const ClothControl<ColliderControl>& collider) {
  if (collider.control.collider < cloth.controls().colliders().collider_count()) {
    return Status::Ok();
  }
  return NotFound("COLLIDER_NOT_FOUND", collider.cloth_index,
                  "the collider " + std::to_string(collider.control.collider));
}

Status Check(ClothRuntime& /*cloth*/, const ClothControl<LengthScale>& /*scale*/) {
  return Status::Ok();
}

Status Check(ClothRuntime& cloth, const ClothControl<LengthControl>& length) {
  const uint32_t constraint = length.control.constraint;
  if (cloth.controls().lengths().FindConstraint(*cloth.model(), constraint)) return Status::Ok();
  return NotFound("CONSTRAINT_NOT_FOUND", length.cloth_index,
                  "the constraint " + std::to_string(constraint));
}

// When the first length of a cloth is driven, the backend gives the cloth rest lengths of its own,
// with their present values.
Status BeginDriving(Backend& backend, ClothRuntime& cloth) {
  LengthTrack& lengths = cloth.controls().lengths();
  if (lengths.is_driven() || cloth.model()->constraint_count() == 0) return Status::Ok();
  LengthTrack driven;
  driven.Start(*cloth.model());
  ClothUpdate update;
  update.rest_lengths_m = driven.LengthsAt(cloth.now().time_s);
  DRAPE_RETURN_IF_ERROR(backend.Write(cloth.handle(), update));
  lengths = std::move(driven);
  return Status::Ok();
}

Status Prepare(Backend& /*backend*/, ClothRuntime& /*cloth*/, const PinControl& /*control*/) {
  return Status::Ok();
}

// Colliders that rested become colliders that can move, without moving yet.
Status Prepare(Backend& backend, ClothRuntime& cloth, const ColliderControl& /*control*/) {
  if (cloth.controls().colliders().is_moving()) return Status::Ok();
  ColliderTrack track = cloth.controls().colliders();
  track.BeginMoving(cloth.now().time_s);
  ClothUpdate update;
  update.collider_motions = track.At(cloth.now().time_s);
  const LengthTrack& lengths = cloth.controls().lengths();  // another backend may have to know them
  if (lengths.is_driven()) update.rest_lengths_m = lengths.LengthsAt(cloth.now().time_s);
  DRAPE_RETURN_IF_ERROR(backend.Write(cloth.handle(), update));
  cloth.controls().SetColliders(std::move(track));
  return Status::Ok();
}

Status Prepare(Backend& backend, ClothRuntime& cloth, const LengthScale& /*control*/) {
  return BeginDriving(backend, cloth);
}

Status Prepare(Backend& backend, ClothRuntime& cloth, const LengthControl& /*control*/) {
  return BeginDriving(backend, cloth);
}

void Apply(ClothRuntime& cloth, const PinControl& control) {
  PinTrack& pins = cloth.controls().pins();
  const size_t pin = *FindPin(*cloth.model(), control.particle);
  // The pin is already at this target, so the cloth may stay asleep.
  if (pins.is_settled() && control.target_m == pins.motion(pin).goal) return;
  pins.Move(pin, control.target_m, control.over_s, cloth.now().time_s);
}

void Apply(ClothRuntime& cloth, const ColliderControl& control) {
  cloth.controls().colliders().Move(control.collider, control.target, control.over_s,
                                    cloth.now().time_s);
}

void Apply(ClothRuntime& cloth, const LengthScale& control) {
  LengthTrack& lengths = cloth.controls().lengths();
  if (!lengths.is_driven()) return;  // without constraints
  lengths.Scale(*cloth.model(), control.scale, control.over_s, cloth.now().time_s);
}

void Apply(ClothRuntime& cloth, const LengthControl& control) {
  LengthTrack& lengths = cloth.controls().lengths();
  lengths.Move(*lengths.FindConstraint(*cloth.model(), control.constraint), control.length_m,
               control.over_s, cloth.now().time_s);
}

// At the end of the last step.
std::vector<GripState> GripsOf(const ClothRuntime& cloth) {
  std::vector<GripState> states;
  const GripTrack& grips = cloth.controls().grips();
  for (uint32_t slot = 0; slot < grips.slot_count(); ++slot) {
    GripState& state = states.emplace_back();
    state.particle = grips.particle(slot);
    if (state.particle) state.position_m = grips.PositionAt(slot, cloth.now().time_s);
  }
  return states;
}

}  // namespace

ActiveRequest::ActiveRequest(StepWork work, int64_t submitted_us, uint32_t session, uint64_t round)
    : work_(std::move(work)),
      session_(session),
      submitted_us_(submitted_us),
      last_round_(round),
      idle_since_us_(submitted_us) {
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
    held_cloths_ += cloth->is_held();
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

uint64_t ActiveRequest::StepsAtStart(uint32_t cloth_index) const {
  const RestartPoint* const restart = RestartOf(cloth_index);
  return restart ? restart->completed_steps : work_.cloths[cloth_index]->now().completed_steps;
}

bool ActiveRequest::IsFaultedAtStart(uint32_t cloth_index) const {
  const RestartPoint* const restart = RestartOf(cloth_index);
  return restart ? restart->is_faulted : work_.cloths[cloth_index]->is_faulted();
}

Status ActiveRequest::CheckExpectations(uint32_t max_steps) const {
  for (uint32_t k = 0; k < work_.cloths.size(); ++k) {
    const ClothRuntime& cloth = *work_.cloths[k];
    if (!cloth.is_alive()) {
      return {StatusCode::kNotFound, "CLOTH_NOT_FOUND",
              "cloth " + std::to_string(k) + " of the request was deleted"};
    }
    if (IsFaultedAtStart(k)) continue;
    const uint64_t completed = StepsAtStart(k);
    if (!RestartOf(k) && work_.expected_step.has_value() && completed != *work_.expected_step) {
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

Status ActiveRequest::CheckWorlds() const {
  std::unordered_map<const ClothRuntime*, uint32_t> places;
  for (uint32_t k = 0; k < work_.cloths.size(); ++k) {
    if (work_.cloths[k]->world() != nullptr) places.emplace(work_.cloths[k].get(), k);
  }
  std::vector<uint64_t> missing_ids;
  std::set<const ClothWorld*> worlds;
  for (const auto& [cloth, place] : places) worlds.insert(cloth->world().get());
  for (const ClothWorld* const world : worlds) {
    for (const ClothWorld::Member& member : world->members()) {
      if (!places.contains(member.cloth)) missing_ids.push_back(member.id);
    }
  }
  if (!missing_ids.empty()) {
    std::ranges::sort(missing_ids);
    return WorldIncomplete(missing_ids);
  }
  const auto has_fault = [&](const ClothRuntime& cloth) {
    return IsFaultedAtStart(places.at(&cloth));
  };
  const auto completed_steps = [&](const ClothRuntime& cloth) {
    return StepsAtStart(places.at(&cloth));
  };
  for (const ClothWorld* const world : worlds) {
    const ClothRuntime& first = *world->members()[0].cloth;
    for (const ClothWorld::Member& member : world->members()) {
      if (has_fault(*member.cloth) != has_fault(first)) {
        const uint64_t id = has_fault(first) ? world->members()[0].id : member.id;
        return {StatusCode::kFailedPrecondition, "WORLD_FAULTED",
                "cloth " + std::to_string(id) + " is faulted, but not all cloths of its world " +
                    "are: reset or delete those that are"};
      }
      if (work_.until_step && completed_steps(*member.cloth) != completed_steps(first)) {
        return StepMismatch(*member.cloth, places.at(member.cloth),
                            "another cloth of its world " + std::to_string(completed_steps(first)) +
                                ": use steps instead of until_step");
      }
    }
  }
  return Status::Ok();
}

void ActiveRequest::FormUnits() {
  const auto count = static_cast<uint32_t>(work_.cloths.size());
  ends_unit_.assign(count, true);
  std::unordered_map<const ClothRuntime*, uint32_t> places;
  for (uint32_t k = 0; k < count; ++k) {
    if (work_.cloths[k]->world() != nullptr) places.emplace(work_.cloths[k].get(), k);
  }
  for (uint32_t k = 0; k < count; ++k) {
    const ClothWorld* const world = work_.cloths[k]->world().get();
    if (world != nullptr && world->members()[0].cloth != work_.cloths[k].get()) continue;
    unit_begins_.push_back(static_cast<uint32_t>(order_.size()));
    if (world == nullptr) {
      order_.push_back(k);
      continue;
    }
    for (const ClothWorld::Member& member : world->members()) {
      order_.push_back(places.at(member.cloth));
      ends_unit_[order_.back()] = &member == &world->members().back();
    }
  }
  unit_begins_.push_back(count);
}

Status ActiveRequest::ApplyControls(Backend& backend) {
  const StepControls& controls = work_.controls;
  const auto cloth_of = [&](const auto& control) -> ClothRuntime& {
    return *work_.cloths[control.cloth_index];
  };
  // Of cloths that get another description with `restart`, only then.
  const auto check = [&](bool has_other_description) {
    return controls.ForEach([&](const auto& control) {
      const RestartPoint* const restart = RestartOf(control.cloth_index);
      const bool has_other = restart && restart->has_other_description;
      return has_other == has_other_description ? Check(cloth_of(control), control) : Status::Ok();
    });
  };
  DRAPE_RETURN_IF_ERROR(check(false));
  if (work_.restart) DRAPE_RETURN_IF_ERROR(work_.restart(backend));
  DRAPE_RETURN_IF_ERROR(check(true));
  DRAPE_RETURN_IF_ERROR(controls.ForEach(
      [&](const auto& control) { return Prepare(backend, cloth_of(control), control.control); }));
  DRAPE_RETURN_IF_ERROR(controls.ForEach([&](const auto& control) {
    Apply(cloth_of(control), control.control);
    return Status::Ok();
  }));
  std::set<uint32_t> with_moved_colliders;
  for (const auto& control : controls.colliders) with_moved_colliders.insert(control.cloth_index);
  for (const uint32_t k : with_moved_colliders) work_.cloths[k]->controls().ShowColliders();
  ApplyGrips(backend);
  return Status::Ok();
}

void ActiveRequest::ApplyGrips(Backend& backend) {
  const GrabbedPositions grabbed(backend, work_.controls.grips, work_.cloths);
  for (const auto& row : work_.controls.grips) {
    const auto& [k, control] = row;
    ClothRuntime& cloth = *work_.cloths[k];
    GripTrack& grips = cloth.controls().grips();
    if (control.action == GripAction::kHold) {
      grips.Hold(control.slot, control.place_m, control.over_s, cloth.now().time_s);
      continue;
    }
    grips.Release(control.slot);
    if (!Grabs(control)) continue;
    const auto particle = grabbed.GrabbedBy(row, cloth);
    if (!particle) continue;
    grips.Grab(control.slot, *particle, grabbed.PositionOf(k, *particle), control.place_m,
               cloth.now().time_s, control.largest_force_n);
  }
}

bool ActiveRequest::LooksReady(Backend& backend) {
  const bool tells_impulses = work_.impulses || work_.contacts;
  if ((!tells_impulses && !work_.report) || backend.device() == nullptr) return true;
  is_ready_ = backend.device()->IsReadyToMeasure() &&
              (!tells_impulses || std::ranges::all_of(work_.cloths, [&](const auto& cloth) {
                return !cloth->is_alive() || cloth->is_faulted() ||
                       backend.device()->IsReadyToTellImpulses(cloth->handle());
              }));
  return is_ready_;
}

Status ActiveRequest::Start(Backend& backend, uint32_t max_steps) {
  DRAPE_CHECK(has_every_turn() && !has_started_, "a request starts once, when it has every turn");
  DRAPE_RETURN_IF_ERROR(CheckExpectations(max_steps));
  DRAPE_RETURN_IF_ERROR(CheckWorlds());
  DRAPE_RETURN_IF_ERROR(ApplyControls(backend));
  has_started_ = true;
  FormUnits();
  steps_left_.resize(work_.cloths.size());
  if (work_.report) reports_.resize(work_.cloths.size());
  if (work_.impulses || work_.contacts) {
    impulses_.resize(work_.cloths.size());
    models_.resize(work_.cloths.size());
  }
  for (size_t k = 0; k < work_.cloths.size(); ++k) {
    const ClothRuntime& cloth = *work_.cloths[k];
    if (cloth.is_faulted()) {
      // A step leaves a faulted cloth as it is; one step, for its report.
      steps_left_[k] = work_.report ? 1 : 0;
    } else if (work_.steps.has_value()) {
      steps_left_[k] = *work_.steps;
    } else {
      steps_left_[k] = static_cast<uint32_t>(*work_.until_step - cloth.now().completed_steps);
    }
    units_to_step_ += steps_left_[k] > 0 && ends_unit_[k];
  }
  return Status::Ok();
}

std::span<const uint32_t> ActiveRequest::Costs(const SolveRate& rate, double us_per_cost,
                                               uint32_t max_cost) {
  costs_.clear();
  for (uint32_t n = 0; n < unit_count(); ++n) {
    const uint32_t unit = (cursor_ + n) % unit_count();
    if (!HasStepsLeft(unit)) continue;
    double expected_us = 0;
    for (const uint32_t k : Unit(unit)) expected_us += work_.cloths[k]->ExpectedCost_us(rate);
    costs_.push_back(static_cast<uint32_t>(
        std::clamp<double>(std::ceil(expected_us / us_per_cost), 1, max_cost)));
  }
  return costs_;
}

std::span<const uint32_t> ActiveRequest::NextUnit() const {
  DRAPE_CHECK(units_to_step_ > 0, "a request has no more cloths to step");
  uint32_t next = cursor_;
  while (!HasStepsLeft(next)) next = (next + 1) % unit_count();
  return Unit(next);
}

void ActiveRequest::TakeAgain(uint32_t cloth_index) {
  const auto place = std::ranges::find(order_, cloth_index) - order_.begin();
  const auto after = std::ranges::upper_bound(unit_begins_, static_cast<uint32_t>(place));
  cursor_ = static_cast<uint32_t>(after - unit_begins_.begin()) - 1;
}

std::vector<uint32_t> ActiveRequest::Take(uint32_t count, uint64_t round) {
  DRAPE_CHECK(count <= units_to_step_, "a request has no more cloths to step");
  if (!std::exchange(was_taken_, true)) trace::Waited("queue", submitted_us_);
  std::vector<uint32_t> taken;
  taken.reserve(count);
  while (count > 0) {
    if (HasStepsLeft(cursor_)) {
      const std::span<const uint32_t> unit = Unit(cursor_);
      taken.insert(taken.end(), unit.begin(), unit.end());
      --count;
    }
    cursor_ = (cursor_ + 1) % unit_count();
  }
  last_round_ = round;
  return taken;
}

bool ActiveRequest::AsksImpulses(uint32_t cloth_index) const {
  return (work_.impulses || work_.contacts) && steps_left_[cloth_index] == 1;
}

bool ActiveRequest::AsksContacts(uint32_t cloth_index) const {
  return work_.contacts && steps_left_[cloth_index] == 1;
}

bool ActiveRequest::IsMeasured(uint32_t cloth_index) const {
  return work_.report && steps_left_[cloth_index] == 1;
}

void ActiveRequest::CompleteStep(uint32_t cloth_index, const StepReport& report) {
  const ClothRuntime& cloth = *work_.cloths[cloth_index];
  const bool is_measured = IsMeasured(cloth_index);
  if (AsksImpulses(cloth_index) && report.impulses != nullptr) {
    impulses_[cloth_index] = report.impulses;
    models_[cloth_index] = cloth.model();
  }
  uint32_t& left = steps_left_[cloth_index];
  left -= 1;
  if (is_measured) {
    reports_[cloth_index] = cloth.Shifted(report);
  } else if (report.fault != FaultReason::kNone) {
    left = work_.report ? 1 : 0;  // one more for the report, see Start
  }
  units_to_step_ -= left == 0 && ends_unit_[cloth_index];
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
  outcome.has_impulses = work_.impulses;
  outcome.has_contacts = work_.contacts;
  outcome.cloths.resize(work_.cloths.size());
  for (size_t k = 0; k < work_.cloths.size(); ++k) {
    outcome.cloths[k].stamp = StampOf(*work_.cloths[k]);
    outcome.cloths[k].warnings = work_.cloths[k]->now().warnings;
    if (work_.report) outcome.cloths[k].report = reports_[k];
    if (work_.impulses || work_.contacts) {
      outcome.cloths[k].impulses = impulses_[k];
      outcome.cloths[k].model = models_[k];
    }
    if (work_.grip_states) outcome.cloths[k].grips = GripsOf(*work_.cloths[k]);
  }
  return outcome;
}

}  // namespace drape
