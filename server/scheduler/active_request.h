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

// Legal order of events: constructed -> EnterTurns -> (has every turn) Start -> Take / CompleteStep
// until is_done -> LeaveTurns -> outcome. EndWith may come at any time before the last. Device
// thread.
class ActiveRequest {
 public:
  // `tenant`: dense index of work.tenant. `round`: rounds before this request came.
  ActiveRequest(StepWork work, int64_t submitted_us, uint32_t tenant, uint64_t round);

  const StepWork& work() const { return work_; }
  uint32_t tenant() const { return tenant_; }

  // In every turn list of its cloths at the end, and out of them (cloth_runtime.h turns()).
  void EnterTurns();
  void LeaveTurns();
  bool has_every_turn() const { return missing_turns_ == 0; }

  // Checks what must hold before anything moves, applies the controls, and finds out how many steps
  // each cloth has to do. An error ends the request. `backend` is told of cloths that get rest
  // lengths of their own, and of colliders that begin to move.
  Status Start(Backend& backend, uint32_t max_steps);
  bool has_started() const { return has_started_; }

  // The request ends as soon as the loop sees it, with this status; the first one counts.
  void EndWith(const Status& status);
  const std::optional<Status>& end_status() const { return end_status_; }

  // Cloths that have steps left.
  uint32_t cloths_to_step() const { return cloths_to_step_; }
  bool is_done() const { return has_started_ && cloths_to_step_ == 0; }
  uint64_t last_round() const { return last_round_; }

  // Of each cloth that has steps left, in the order in which Take takes them, the places that it
  // occupies in a batch: one for every `solves_per_place` that its step may cost, at least one.
  // Valid until the next call.
  std::span<const uint32_t> Places(double solves_per_place);
  // The next `count` (<= cloths_to_step) cloths in turn, as indices into work().cloths. They take
  // part in round `round`.
  std::vector<uint32_t> Take(uint32_t count, uint64_t round);
  // The next step of this cloth is its last one and a report is wanted.
  bool IsMeasured(uint32_t cloth_index) const;
  // Takes in the report of one step; the runtime has not seen it yet.
  void CompleteStep(uint32_t cloth_index, const StepReport& report);
  // The batch that this request took part in, from `begin_us` to `end_us`, is over.
  void AddBatch(const BatchReport& batch, uint32_t cloths, uint32_t requests, int64_t begin_us,
                int64_t end_us);

  // The answer; with the cloths' stamps as they are now.
  StepOutcome Outcome() const;
  // Afterwards the request is empty.
  StepWork TakeWork() && { return std::move(work_); }

 private:
  Status CheckExpectations(uint32_t max_steps) const;
  // All controls, or none and an error.
  Status ApplyControls(Backend& backend);

  StepWork work_;
  const uint32_t tenant_;
  uint32_t missing_turns_ = 0;
  bool has_started_ = false;
  std::optional<Status> end_status_;
  std::vector<uint32_t> steps_left_;                // [cloth]
  std::vector<std::optional<StepReport>> reports_;  // [cloth], only if reports are wanted
  uint32_t cloths_to_step_ = 0;
  uint32_t cursor_ = 0;  // where Take goes on
  std::vector<uint32_t> places_;
  uint64_t last_round_;
  int64_t idle_since_us_;  // submitted, or the end of the last batch
  StepTiming timing_;
};

}  // namespace drape
