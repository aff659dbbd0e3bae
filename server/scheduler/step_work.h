// What goes into the scheduler and what comes out: plain values.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/core/status.h"
#include "server/scheduler/cloth_runtime.h"
#include "server/scheduler/step_controls.h"
#include "server/solver/device_backend.h"

namespace drape {

// Which fields of the states are wanted; none = no states.
struct StateFields {
  bool positions = false;
  bool velocities = false;
  // Of each cloth, strictly ascending, each below its particle count; empty: all.
  std::vector<uint32_t> particles{};

  bool any() const { return positions || velocities; }
  // How many rows of a column are a cloth's.
  uint32_t RowsOf(uint32_t particle_count) const {
    return drape::RowsOf(particles, particle_count);
  }
  // An order, to find those who want the same.
  friend auto operator<=>(const StateFields&, const StateFields&) = default;
};

// The wish that a request should end. Copies share one wish. Thread-safe.
class CancelToken {
 public:
  void Cancel() { *is_cancelled_ = true; }
  bool is_cancelled() const { return *is_cancelled_; }

 private:
  std::shared_ptr<std::atomic<bool>> is_cancelled_ = std::make_shared<std::atomic<bool>>(false);
};

// One cloth when it was read or when a request ended.
struct ClothStamp {
  uint64_t completed_steps = 0;
  double time_s = 0;
  FaultReason fault = FaultReason::kNone;
};

// Device thread; the cloth is alive.
ClothStamp StampOf(const ClothRuntime& cloth);

// States of several cloths, cloth after cloth, in the cloth frame (scene/placement.h leads to the
// world), of each cloth the rows that were asked for. Columns that were not asked for are empty.
struct ClothStates {
  std::vector<ClothStamp> cloths;
  StateColumns columns;
  // Of Scheduler::ReadForDrawing: instead of the columns. Goes on the device thread, or where a
  // context of its share group is current.
  std::shared_ptr<DeviceCopy> on_device;
  // Of the reads of the scheduler: the place that the read occupies as long as its states are held.
  std::shared_ptr<void> in_flight;
};

// Where the time of a request went [us], summed over its batches (each counted whole, not by
// share).
struct StepTiming {
  int64_t queue_us = 0;  // not in any batch: before the first, and between two
  int64_t upload_us = 0;
  int64_t device_us = 0;
  // Reports of every batch, what tells whether its cloths are at rest, and the states at the end.
  int64_t readback_us = 0;
  // Of the batch that held the last step, all requests together.
  uint32_t batch_cloths = 0;
  uint32_t batch_requests = 0;
  uint32_t batch_dispatches = 0;
};

struct ClothOutcome {
  ClothStamp stamp;
  // Since creation or reset.
  WarningCounters warnings;
  // Of the last step, if asked for. Measurements are in the frames that clients see: lowest_m in
  // the world, potential energy zero at the environment's origin. A faulted cloth is measured in
  // its last good state. Unset for a cloth that had no step to do (until_step already reached).
  std::optional<StepReport> report;
};

struct StepOutcome {
  // OK even if cloths faulted. Else the request ended early and the rest is empty:
  //   FAILED_PRECONDITION STEP_MISMATCH: expected_step or until_step does not fit; nothing has
  //   moved. FAILED_PRECONDITION PIN_NOT_FOUND: a pin control names a particle that is no longer
  //   pinned. FAILED_PRECONDITION CONSTRAINT_NOT_FOUND, COLLIDER_NOT_FOUND: a control names a
  //   constraint or a collider that the cloth no longer has. RESOURCE_EXHAUSTED: the device has no
  //   room for rest lengths of the cloth's own or for moving colliders. INVALID_ARGUMENT: more
  //   steps than max_steps_per_request up to until_step. NOT_FOUND CLOTH_NOT_FOUND: a cloth was
  //   deleted, before or during the request. CANCELLED CANCELLED: the token; the steps that were
  //   complete stay. UNAVAILABLE DRAINING: the server shuts down.
  Status status;
  std::vector<ClothOutcome> cloths;  // same order as StepWork::cloths
  StepTiming timing;
  // Set if states were asked for: all cloths of the request, same order, after its last step.
  std::optional<StateColumns> states;
  // When the device had done everything for the request, by the clock of the scheduler [us].
  int64_t device_done_us = 0;
};

// One step request.
struct StepWork {
  std::string tenant;                                 // key of the fair share: the session's name
  std::vector<std::shared_ptr<ClothRuntime>> cloths;  // no duplicates; at least one
  // Exactly one of the two is set.
  std::optional<uint32_t> steps;       // >= 1
  std::optional<uint64_t> until_step;  // every cloth at or before it; faulted ones are left out
  // Every cloth that is not faulted must have completed exactly this many when the request starts.
  std::optional<uint64_t> expected_step;
  StepControls controls;
  bool report = false;  // measure in the last step of each cloth
  StateFields view;     // states after the last step
  CancelToken cancel;   // takes effect after the current round
  // Called exactly once, in order of completion, on the completion thread; on the device thread
  // where that has nothing else to do. Must not block.
  std::function<void(StepOutcome)> done;
};

}  // namespace drape
