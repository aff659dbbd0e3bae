// A step request between Submit and its completion.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "server/scheduler/step_work.h"

namespace drape {

// Legal order of calls: constructor, EnterTurns, Start (once it has every turn), Take and
// CompleteStep until is_done, LeaveTurns, Outcome. EndWith may come at any time before LeaveTurns.
// Device thread.
class ActiveRequest {
 public:
  // `session`: number of work.owner() (SessionIndex). `round`: rounds before this request arrived.
  ActiveRequest(StepWork work, int64_t submitted_us, uint32_t session, uint64_t round);

  const StepWork& work() const { return work_; }
  uint32_t session() const { return session_; }
  int64_t submitted_us() const { return submitted_us_; }

  // Appends the request to the turns of each of its cloths (ClothRuntime::turns), and removes it.
  void EnterTurns();
  void LeaveTurns();
  bool has_every_turn() const { return missing_turns_ == 0; }
  bool may_start() const { return has_every_turn() && !is_held(); }
  // Whether it must wait because one of its cloths is held (ClothRuntime::Hold, which counts).
  bool is_held() const { return held_cloths_ > 0; }
  void AddHeldCloths(int count) { held_cloths_ += count; }

  // Checks the expectations, applies the controls, and counts the steps that each cloth has to do.
  // An error ends the request. Tells `backend` about cloths that get rest lengths of their own and
  // about colliders that begin to move.
  Status Start(Backend& backend, uint32_t max_steps);
  // Whether nothing has to be made first for what it asks for; if not, that is being made
  // (DeviceBackend::IsReadyToMeasure). Before Start, in its turn.
  bool LooksReady(Backend& backend);
  // What LooksReady said last; true before.
  bool is_ready() const { return is_ready_; }
  bool has_started() const { return has_started_; }

  // The request ends with this status as soon as the loop sees it; the first call counts.
  void EndWith(const Status& status);
  const std::optional<Status>& end_status() const { return end_status_; }

  // What has steps left, by what is stepped together: single cloths, and whole worlds.
  uint32_t units_to_step() const { return units_to_step_; }
  bool is_done() const { return has_started_ && units_to_step_ == 0; }
  uint64_t last_round() const { return last_round_; }

  // The cost in a batch of the next step of each unit that has steps left, in the order of Take:
  // one for every `us_per_cost` of its expected duration, at least one and at most `max_cost`.
  // Valid until the next call.
  std::span<const uint32_t> Costs(const SolveRate& rate, double us_per_cost, uint32_t max_cost);
  // The next `count` (<= units_to_step) units, as indices into work().cloths; those of a world
  // follow each other in its order. They take part in round `round`.
  std::vector<uint32_t> Take(uint32_t count, uint64_t round);
  // The unit that Take would take first, which has steps left. Needs units_to_step() > 0.
  std::span<const uint32_t> NextUnit() const;
  // Take begins with the unit of this cloth again, whose step is not complete.
  void TakeAgain(uint32_t cloth_index);
  // Whether the next step of this cloth is its last one and a report is wanted.
  bool IsMeasured(uint32_t cloth_index) const;
  // Whether the next step of the cloth is to tell its impulses.
  bool AsksImpulses(uint32_t cloth_index) const;
  // The same of StepImpulses::contacts; then it tells its impulses.
  bool AsksContacts(uint32_t cloth_index) const;
  // A step of this cloth is done. Before ClothRuntime::CompleteStep.
  void CompleteStep(uint32_t cloth_index, const StepReport& report);
  // A batch that this request took part in lasted from `begin_us` to `end_us`.
  void AddBatch(const BatchReport& batch, uint32_t cloths, uint32_t requests, int64_t begin_us,
                int64_t end_us);

  // The answer, with the cloths' stamps as they are now.
  StepOutcome Outcome() const;
  // Afterwards the request is empty.
  StepWork TakeWork() && { return std::move(work_); }

 private:
  // Null: StepWork::restart leaves the cloth as it is.
  const RestartPoint* RestartOf(uint32_t cloth_index) const {
    if (work_.restarts.empty() || !work_.restarts[cloth_index]) return nullptr;
    return &*work_.restarts[cloth_index];
  }
  // Of a cloth when its first step begins.
  uint64_t StepsAtStart(uint32_t cloth_index) const;
  bool IsFaultedAtStart(uint32_t cloth_index) const;
  Status CheckExpectations(uint32_t max_steps) const;
  // Every world that one of the cloths belongs to is there as a whole, and can be stepped.
  Status CheckWorlds() const;
  void FormUnits();
  std::span<const uint32_t> Unit(uint32_t unit) const {
    return std::span(order_).subspan(unit_begins_[unit],
                                     unit_begins_[unit + 1] - unit_begins_[unit]);
  }
  uint32_t unit_count() const { return static_cast<uint32_t>(unit_begins_.size() - 1); }
  // Of all its cloths.
  bool HasStepsLeft(uint32_t unit) const { return steps_left_[Unit(unit)[0]] > 0; }
  // All controls, or none and an error.
  Status ApplyControls(Backend& backend);
  // Reads where they are if particles are grabbed.
  void ApplyGrips(Backend& backend);

  StepWork work_;
  const uint32_t session_;
  const int64_t submitted_us_;
  uint32_t missing_turns_ = 0;
  int held_cloths_ = 0;  // while it is in their turns
  bool has_started_ = false;
  bool is_ready_ = true;
  bool was_taken_ = false;
  std::optional<Status> end_status_;
  std::vector<uint32_t> steps_left_;                // [cloth]
  std::vector<std::optional<StepReport>> reports_;  // [cloth], only if reports are wanted
  // [cloth], only if impulses are; null: of cloths without a step, or faulted.
  std::vector<std::shared_ptr<const StepImpulses>> impulses_;
  std::vector<std::shared_ptr<const SceneModel>> models_;  // whose impulses these are
  std::vector<uint32_t> order_;                            // cloths, unit after unit
  std::vector<uint32_t> unit_begins_;                      // [unit_count + 1] of order_
  std::vector<bool> ends_unit_;                            // [cloth]: the last one of its unit
  uint32_t units_to_step_ = 0;
  uint32_t cursor_ = 0;  // the unit where Take continues
  std::vector<uint32_t> costs_;
  uint64_t last_round_;
  int64_t idle_since_us_;  // submitted, or the end of the last batch
  StepTiming timing_;
};

}  // namespace drape
