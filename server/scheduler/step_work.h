// The input and output of the scheduler: plain values.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/core/status.h"
#include "server/scheduler/cloth_runtime.h"
#include "server/scheduler/step_controls.h"
#include "server/solver/device_backend.h"

namespace drape {

// The wanted fields of states; none = no states.
struct StateFields {
  bool positions = false;
  bool velocities = false;
  // The same particles of every cloth: strictly ascending, each below every particle count; empty:
  // all.
  std::vector<uint32_t> particles{};

  bool any() const { return positions || velocities; }
  // The rows that one cloth has in a column.
  uint32_t RowsOf(uint32_t particle_count) const {
    return drape::RowsOf(particles, particle_count);
  }
  // Any order, to group requests that want the same.
  friend auto operator<=>(const StateFields&, const StateFields&) = default;
};

// Tells a request to end. Copies are the same token. Thread-safe.
class CancelToken {
 public:
  void Cancel() { *is_cancelled_ = true; }
  bool is_cancelled() const { return *is_cancelled_; }

 private:
  std::shared_ptr<std::atomic<bool>> is_cancelled_ = std::make_shared<std::atomic<bool>>(false);
};

// The progress of a cloth when it was read or when a request ended.
struct ClothStamp {
  uint64_t completed_steps = 0;
  double time_s = 0;
  FaultReason fault = FaultReason::kNone;
};

// Device thread; the cloth is alive.
ClothStamp StampOf(const ClothRuntime& cloth);

// The requested rows of several cloths, cloth after cloth, in the cloth frame (scene/placement.h
// leads to the world). Columns that were not requested are empty.
struct ClothStates {
  std::vector<ClothStamp> cloths;
  StateColumns columns;
  // Set by Scheduler::ReadForDrawing instead of the columns. Drop it on the device thread or where
  // a context of its share group is current.
  std::shared_ptr<DeviceCopy> on_device;
  // Set by the reads of the scheduler: the permit of the read, kept as long as its states.
  std::shared_ptr<void> in_flight;
};

// How the time of a request was spent [us], summed over its batches (each counted as a whole).
struct StepTiming {
  int64_t queue_us = 0;  // not in any batch: before the first, and between two
  int64_t upload_us = 0;
  int64_t device_us = 0;
  // The reports of every batch, the positions that show whether cloths are at rest, and the states
  // at the end.
  int64_t readback_us = 0;
  // About the batch with the last step, all requests together.
  uint32_t batch_cloths = 0;
  uint32_t batch_requests = 0;
  uint32_t batch_dispatches = 0;
};

// One slot of a cloth at the end of a request.
struct GripState {
  std::optional<uint32_t> particle;                      // none: it is open
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  // of the particle, cloth frame
};

struct ClothOutcome {
  ClothStamp stamp;
  // Since creation or reset.
  WarningCounters warnings;
  // The report of the last step, if requested. Measurements are in the frames that clients see:
  // lowest_m in the world, potential energy zero at the environment's origin. A faulted cloth is
  // measured in its last good state. Unset for a cloth that had no step to do (until_step already
  // reached).
  std::optional<StepReport> report;
  std::vector<GripState> grips{};  // of each slot, if requested
  // Of the last step, if these or contacts are requested, and the model that it was stepped with.
  // Null: the cloth is faulted or had no step to do.
  std::shared_ptr<const StepImpulses> impulses{};
  std::shared_ptr<const SceneModel> model{};
};

struct StepOutcome {
  // OK even if cloths faulted. Otherwise the request ended early and the rest is empty:
  //   FAILED_PRECONDITION STEP_MISMATCH: expected_step or until_step does not fit; nothing moved
  //   FAILED_PRECONDITION PIN_NOT_FOUND, CONSTRAINT_NOT_FOUND, COLLIDER_NOT_FOUND: a control names
  //     a pin, a constraint or a collider that the cloth no longer has
  //   FAILED_PRECONDITION WORLD_INCOMPLETE: cloths of a world are missing, or one has joined it;
  //     WORLD_FAULTED: some of its cloths are faulted and others are not
  //   RESOURCE_EXHAUSTED: the device has no room for driven rest lengths or moving colliders
  //   INVALID_ARGUMENT: until_step is more than max_steps_per_request steps away
  //   NOT_FOUND CLOTH_NOT_FOUND: a cloth was deleted before or during the request
  //   CANCELLED CANCELLED: the token was used; completed steps stay
  //   CANCELLED DEADLINE_PASSED: nothing has moved
  //   RESOURCE_EXHAUSTED RATE_EXCEEDED: the rate of the tenant lets nothing begin in time
  //   UNAVAILABLE DRAINING: the server shuts down
  Status status;
  std::vector<ClothOutcome> cloths;  // same order as StepWork::cloths
  bool has_impulses = false;         // StepWork::impulses
  bool has_contacts = false;         // StepWork::contacts
  StepTiming timing;
  // Set if states were requested: all cloths of the request, same order, after its last step.
  std::optional<StateColumns> states;
  // RESOURCE_EXHAUSTED DEVICE_MEMORY: all steps were made, but there was no memory for the states.
  Status states_status;
  // When the device had finished the request, by the clock of the scheduler [us].
  int64_t device_done_us = 0;
};

// Where StepWork::restart puts a cloth.
struct RestartPoint {
  uint64_t completed_steps = 0;
  bool is_faulted = false;
  // It gets another description, and its controls are for that one.
  bool has_other_description = false;
};

// In whose name pools and turns are shared: the tenant, or without tenants the session.
inline const std::string& OwnerOf(const std::string& session, const std::string& tenant) {
  return tenant.empty() ? session : tenant;
}

// One step request.
struct StepWork {
  // Who shares the device fairly with others.
  const std::string& owner() const { return OwnerOf(session, tenant); }

  std::string session;                                // the session's name
  std::string tenant{};                               // of the session; empty: there are no tenants
  std::vector<std::shared_ptr<ClothRuntime>> cloths;  // no duplicates; at least one
  // Exactly one of the two is set.
  std::optional<uint32_t> steps;       // >= 1
  std::optional<uint64_t> until_step;  // every cloth at or before it; faulted ones are left out
  // The steps that every cloth that is not faulted must have completed when the request starts.
  std::optional<uint64_t> expected_step;
  StepControls controls;
  // Makes cloths start again, or go on from a saved state: on the device thread when the request
  // starts, once everything is checked and before the controls act. All of them, or none and an
  // error, which ends the request.
  std::function<Status(Backend&)> restart;
  // [cloth], unset where `restart` leaves a cloth as it is; or empty. Nothing is expected of the
  // steps so far of a cloth that it does not.
  std::vector<std::optional<RestartPoint>> restarts;
  bool report = false;       // measure in the last step of each cloth
  bool grip_states = false;  // ClothOutcome::grips
  bool impulses = false;     // ClothOutcome::impulses
  bool contacts = false;     // the same, with StepImpulses::contacts
  StateFields view;          // states after the last step
  CancelToken cancel;        // takes effect after the current round
  // When the client stops waiting, by the clock of the scheduler; it must have started by then.
  int64_t deadline_us = std::numeric_limits<int64_t>::max();
  // Called exactly once, in order of completion, on the completion thread, or on the device thread
  // if that has nothing else to do. Must not block.
  std::function<void(StepOutcome)> done;
};

}  // namespace drape
