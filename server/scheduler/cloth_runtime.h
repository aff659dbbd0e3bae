// The part of a cloth that lives on the device thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <vector>

#include "server/core/ids.h"
#include "server/scene/scene_model.h"
#include "server/scheduler/change_bell.h"
#include "server/scheduler/cloth_controls.h"
#include "server/scheduler/cloth_world.h"
#include "server/scheduler/cost_estimate.h"
#include "server/scheduler/frame_budget.h"
#include "server/scheduler/sleep_watch.h"
#include "server/solver/step_report.h"

namespace drape {

class ActiveRequest;

// Steps in which a numerical event occurred, since creation or reset.
struct WarningCounters {
  uint64_t tolerance_raised = 0;
  uint64_t not_converged = 0;
  uint64_t springs_beyond_limit = 0;
  uint64_t elastic_beyond_limit = 0;
  uint64_t springs_gain_energy = 0;
  uint64_t energy_gained = 0;
  uint64_t over_budget = 0;
  uint64_t strain_beyond_limit = 0;
  uint64_t starts_crossing = 0;
  uint64_t contacts_given_up = 0;

  void Count(const StepWarnings& warnings);
  friend bool operator==(const WarningCounters&, const WarningCounters&) = default;
};

// The progress of a cloth.
struct ClothProgress {
  uint64_t completed_steps = 0;
  double time_s = 0;  // simulated
  // Other than kNone: the cloth stays at its last good state until it is reset.
  FaultReason fault = FaultReason::kNone;
  WarningCounters warnings;
};

// A ClothProgress that one thread writes and any thread reads without a lock: the writer never
// waits, a reader always sees the values of one and the same Publish (sequence lock over atomics).
class PublishedProgress {
 public:
  void Publish(const ClothProgress& progress);  // one thread
  ClothProgress Read() const;                   // any thread

 private:
  std::atomic<uint64_t> sequence_{0};  // odd while a Publish is under way
  std::atomic<uint64_t> completed_steps_{0};
  std::atomic<double> time_s_{0};
  std::atomic<FaultReason> fault_{FaultReason::kNone};
  std::atomic<uint64_t> tolerance_raised_{0};
  std::atomic<uint64_t> not_converged_{0};
  std::atomic<uint64_t> springs_beyond_limit_{0};
  std::atomic<uint64_t> elastic_beyond_limit_{0};
  std::atomic<uint64_t> springs_gain_energy_{0};
  std::atomic<uint64_t> energy_gained_{0};
  std::atomic<uint64_t> over_budget_{0};
  std::atomic<uint64_t> strain_beyond_limit_{0};
  std::atomic<uint64_t> starts_crossing_{0};
  std::atomic<uint64_t> contacts_given_up_{0};
};

// Everything that the steps of a cloth depend on besides its particles, model and parameters: a
// copy of one moment between two steps. Cloth frame.
struct RuntimeState {
  ClothProgress progress;
  double time_step_s = 0;
  double base_time_s = 0;  // when the time step last changed
  uint64_t base_steps = 0;
  PinTrack pins;
  GripTrack grips;
  LengthTrack lengths;
  ColliderTrack colliders;
  FrameBudget budget;
  SleepWatch sleep;
  EnergyBalance energy;          // StepItem::energy of the next step
  bool may_cross_itself = true;  // Backend::MayCrossItself; filled in by who reads the particles

  // Of the memory outside this object, to be counted.
  uint64_t held_bytes() const;
};

// Added to a report's measurements to bring them from the cloth's frame to the frames that clients
// see.
struct ReportShift {
  double lowest_m = 0;            // cloth frame to world
  double potential_energy_j = 0;  // zero at the cloth's origin to zero at the environment's
};

// THREAD RULE: everything but progress() and collider_motions() is for the device thread only:
// inside a function passed to Scheduler::Post or PostCleanup, or inside the scheduler. It is
// created anywhere and passed to one such function, which calls Begin. Shared pointers to it may be
// held and dropped on any thread.
//
// Life: constructor, Begin, (steps, Reset, SetSettings, ...), End. Before Begin and after End it is
// not alive: work that names it ends with NOT_FOUND, reason CLOTH_NOT_FOUND.
class ClothRuntime {
 public:
  ClothRuntime() = default;
  ClothRuntime(const ClothRuntime&) = delete;
  ClothRuntime& operator=(const ClothRuntime&) = delete;

  // Any thread.
  ClothProgress progress() const { return published_.Read(); }
  // The present poses and velocities of the colliders, in the cloth frame; empty: they rest as
  // described.
  std::vector<RigidMotion> collider_motions() const {
    return controls_.CollidersAt(progress().time_s);
  }

  // --- Device thread from here on. ---

  // The backend has created the cloth as `handle`. Pins begin at `pin_starts_m` and move to
  // `pin_targets_m` in the first step; both [pin_count] in the cloth frame.
  void Begin(ClothHandle handle, std::shared_ptr<const SceneModel> model,
             const StepSettings& settings, const ReportShift& shift,
             const std::vector<Eigen::Vector3d>& pin_starts_m,
             const std::vector<Eigen::Vector3d>& pin_targets_m);
  // The backend no longer has the cloth. Every step request that names it ends with `reason` before
  // any of its cloths is stepped again.
  void End(const Status& reason);

  // It is alive: from now on it is stepped with the others of this world, until End.
  void Join(std::shared_ptr<ClothWorld> world, uint64_t id, const Eigen::Vector3d& origin_m);
  // It ends in this command, like others: the first of its world that ends takes all of them out.
  void BeginLeaving() { is_leaving_ = true; }
  bool is_leaving() const { return is_leaving_; }
  // For ClothWorld::DropLeaving only.
  void ForgetWorld() { world_ = nullptr; }
  // Null: it is stepped by itself.
  const std::shared_ptr<ClothWorld>& world() const { return world_; }

  bool is_alive() const { return is_alive_; }
  ClothHandle handle() const { return handle_; }
  const std::shared_ptr<const SceneModel>& model() const { return model_; }
  uint32_t particle_count() const { return model_->particle_count(); }
  const ClothProgress& now() const { return progress_; }
  bool is_faulted() const { return progress_.fault != FaultReason::kNone; }
  // What contacts gave in the last step, if that told them (StepImpulses::contacts) and nothing has
  // changed the state since; null: unknown.
  const StepImpulses* last_contacts() const {
    return contacts_version_ == state_version_ ? contacts_.get() : nullptr;
  }
  // Counts changes of the particle state (steps, resets): equal versions = equal states.
  uint64_t state_version() const { return state_version_; }
  // Counts resets, after which completed_steps starts at 0 again.
  uint64_t reset_count() const { return reset_count_; }
  ClothControls& controls() { return controls_; }
  const ClothControls& controls() const { return controls_; }
  // The settings of all steps from now on. Wakes the cloth, because a change of settings may act on
  // it.
  void SetSettings(const StepSettings& settings);
  const StepSettings& settings() const { return budget_.settings(); }
  FrameBudget& budget() { return budget_; }
  SleepWatch& sleep() { return sleep_; }
  const SleepWatch& sleep() const { return sleep_; }
  // What the next step gives to pins and grips decides how the cloth goes on, or is what will be
  // told of it while it sleeps. `are_cheap`: also if nobody has ever asked for them.
  bool WantsImpulses(bool are_cheap) const {
    return controls_.grips().has_largest_forces() ||
           (sleep_.decides_next() && (are_cheap || was_asked_for_impulses_));
  }
  // The same of those by each contact, which take memory while it sleeps: once somebody has asked.
  bool WantsContacts() const { return sleep_.decides_next() && was_asked_for_contacts_; }
  // The next step is asked for impulses, `by_contact` too. Whether it must be computed for that:
  // the cloth sleeps, and fell asleep when nobody had asked.
  bool MustWakeForImpulses(bool by_contact) {
    was_asked_for_impulses_ = true;
    was_asked_for_contacts_ |= by_contact;
    const StepImpulses* const known = sleep_.report().impulses.get();
    const bool is_known = known != nullptr && (!by_contact || known->contacts.has_value());
    return sleep_.is_asleep() && !is_faulted() && !is_known;
  }
  // The next step is not computed: it is asleep and nothing wakes it, or faulted.
  bool is_idle() const { return is_faulted() || (sleep_.is_asleep() && controls_.are_at_rest()); }
  // Upper bound of the solves of the next step (step_settings.h, SolvesPerStep). 0: it is idle.
  double solves_per_step() const {
    if (is_idle()) return 0;
    return SolvesPerStep(*model_, budget_.settings(), controls_.colliders().collider_count());
  }
  // Of each step, as RateQuota counts it: particles times substeps.
  double work_per_step() const {
    return static_cast<double>(uint64_t{particle_count()} * settings().substeps);
  }
  // What the next step will probably cost [us]; infinite while it is being done in pieces.
  double ExpectedCost_us(const SolveRate& rate) const {
    if (is_in_pieces_) return std::numeric_limits<double>::infinity();
    const double solves = solves_per_step();
    if (solves == 0) return 0;
    return cost_.Expected_us(solves, budget_.settings().tolerance > 0, rate);
  }
  CostEstimate& cost() { return cost_; }
  // Whether a part of the next step is done. For the device loop only.
  void SetInPieces(bool is_in_pieces) { is_in_pieces_ = is_in_pieces; }

  // Simulated time at the end of the next step: base time + steps since * time step, so that a
  // cloth whose time step never changed is at exactly step * time step.
  double NextTime_s() const;
  // StepItem::energy of the next step.
  const EnergyBalance& energy() const { return energy_; }
  // The backend did a step and reported this. After a fault, steps and time are unchanged.
  void CompleteStep(const StepReport& report);
  // A step of a sleeping cloth: only the time advances.
  void CompleteStepAsleep();
  // Adds the shift to the report's measurements.
  StepReport Shifted(StepReport report) const;

  // Step 0, time 0, no fault, no warnings; pins as in Begin, rest lengths of the model. The caller
  // has written the state, and starts the colliders.
  void Reset(const std::vector<Eigen::Vector3d>& pin_starts_m,
             const std::vector<Eigen::Vector3d>& pin_targets_m);
  // The caller has written another state: no fault any longer, and awake. Step and time go on.
  void Restate();
  RuntimeState Save() const;
  // As it was when `state` was saved, of this cloth or one like it. The caller has written the
  // particles, targets and lengths, and has set model and shift.
  void Restore(RuntimeState state);
  void SetShift(const ReportShift& shift) { shift_ = shift; }
  // A model of the same particle count, which the backend has already. The caller replaces the pins
  // and lengths of controls().
  void SetModel(std::shared_ptr<const SceneModel> model) {
    if (model != model_) cost_.Forget();
    model_ = std::move(model);
  }

  // From now on whatever changes what is seen of the cloth rings `bell` as its cloth `index`, as
  // long as the bell exists.
  void Watch(const std::shared_ptr<ChangeBell>& bell, uint32_t index);

  // Work of several commands changes the cloth: until Release it is not stepped, and no request
  // that names it starts.
  void Hold();
  void Release();
  bool is_held() const { return is_held_; }

  // Step requests that name this cloth, in order of arrival; the first one has the turn
  // (active_request.h). For the scheduler only.
  std::deque<ActiveRequest*>& turns() { return turns_; }

 private:
  double TimeAfter_s(uint64_t completed_steps) const;
  // They are where the step that is complete has moved them.
  void FollowBodies(const StepReport& report);
  void SetTimeStep(double time_step_s);
  // To progress() and to those who watch.
  void TellChange();
  void RingBells();

  bool is_alive_ = false;
  bool is_leaving_ = false;
  ClothHandle handle_;
  std::shared_ptr<const SceneModel> model_;
  ReportShift shift_;
  double time_step_s_ = 0;
  double base_time_s_ = 0;   // when the time step last changed
  uint64_t base_steps_ = 0;  // completed then
  ClothProgress progress_;
  EnergyBalance energy_;  // RuntimeState
  uint64_t state_version_ = 0;
  std::shared_ptr<const StepImpulses> contacts_;  // null: the last step did not tell them
  uint64_t contacts_version_ = 0;                 // the state that they led to
  uint64_t reset_count_ = 0;
  ClothControls controls_;
  FrameBudget budget_;
  CostEstimate cost_;
  bool is_in_pieces_ = false;
  bool is_held_ = false;
  bool was_asked_for_impulses_ = false, was_asked_for_contacts_ = false;
  SleepWatch sleep_;
  std::deque<ActiveRequest*> turns_;
  std::shared_ptr<ClothWorld> world_;
  struct Watcher {
    std::weak_ptr<ChangeBell> bell;
    uint32_t index = 0;
  };
  std::vector<Watcher> watchers_;
  PublishedProgress published_;
};

}  // namespace drape
