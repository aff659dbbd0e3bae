#include "server/scheduler/cloth_runtime.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "server/scheduler/active_request.h"

namespace drape {

void WarningCounters::Count(const StepWarnings& warnings) {
  tolerance_raised += warnings.tolerance_raised;
  not_converged += warnings.not_converged;
  springs_beyond_limit += warnings.springs_beyond_limit;
  elastic_beyond_limit += warnings.elastic_beyond_limit;
  springs_gain_energy += warnings.springs_gain_energy;
  energy_gained += warnings.energy_gained;
  over_budget += warnings.over_budget;
  strain_beyond_limit += warnings.strain_beyond_limit;
  starts_crossing += warnings.starts_crossing;
  contacts_given_up += warnings.contacts_given_up;
}

void PublishedProgress::Publish(const ClothProgress& progress) {
  const uint64_t sequence = sequence_.load(std::memory_order_relaxed);
  sequence_.store(sequence + 1, std::memory_order_relaxed);
  // No value below may become visible before the odd sequence number.
  std::atomic_thread_fence(std::memory_order_release);
  completed_steps_.store(progress.completed_steps, std::memory_order_relaxed);
  time_s_.store(progress.time_s, std::memory_order_relaxed);
  fault_.store(progress.fault, std::memory_order_relaxed);
  tolerance_raised_.store(progress.warnings.tolerance_raised, std::memory_order_relaxed);
  not_converged_.store(progress.warnings.not_converged, std::memory_order_relaxed);
  springs_beyond_limit_.store(progress.warnings.springs_beyond_limit, std::memory_order_relaxed);
  elastic_beyond_limit_.store(progress.warnings.elastic_beyond_limit, std::memory_order_relaxed);
  springs_gain_energy_.store(progress.warnings.springs_gain_energy, std::memory_order_relaxed);
  energy_gained_.store(progress.warnings.energy_gained, std::memory_order_relaxed);
  over_budget_.store(progress.warnings.over_budget, std::memory_order_relaxed);
  strain_beyond_limit_.store(progress.warnings.strain_beyond_limit, std::memory_order_relaxed);
  starts_crossing_.store(progress.warnings.starts_crossing, std::memory_order_relaxed);
  contacts_given_up_.store(progress.warnings.contacts_given_up, std::memory_order_relaxed);
  sequence_.store(sequence + 2, std::memory_order_release);
}

ClothProgress PublishedProgress::Read() const {
  for (;;) {
    const uint64_t before = sequence_.load(std::memory_order_acquire);
    ClothProgress progress;
    progress.completed_steps = completed_steps_.load(std::memory_order_relaxed);
    progress.time_s = time_s_.load(std::memory_order_relaxed);
    progress.fault = fault_.load(std::memory_order_relaxed);
    progress.warnings.tolerance_raised = tolerance_raised_.load(std::memory_order_relaxed);
    progress.warnings.not_converged = not_converged_.load(std::memory_order_relaxed);
    progress.warnings.springs_beyond_limit = springs_beyond_limit_.load(std::memory_order_relaxed);
    progress.warnings.elastic_beyond_limit = elastic_beyond_limit_.load(std::memory_order_relaxed);
    progress.warnings.springs_gain_energy = springs_gain_energy_.load(std::memory_order_relaxed);
    progress.warnings.energy_gained = energy_gained_.load(std::memory_order_relaxed);
    progress.warnings.over_budget = over_budget_.load(std::memory_order_relaxed);
    progress.warnings.strain_beyond_limit = strain_beyond_limit_.load(std::memory_order_relaxed);
    progress.warnings.starts_crossing = starts_crossing_.load(std::memory_order_relaxed);
    progress.warnings.contacts_given_up = contacts_given_up_.load(std::memory_order_relaxed);
    // No value above may be read after the sequence number is read again.
    std::atomic_thread_fence(std::memory_order_acquire);
    if (before % 2 == 0 && sequence_.load(std::memory_order_relaxed) == before) return progress;
  }
}

void ClothRuntime::Begin(ClothHandle handle, std::shared_ptr<const SceneModel> model,
                         const StepSettings& settings, const ReportShift& shift,
                         const std::vector<Eigen::Vector3d>& pin_starts_m,
                         const std::vector<Eigen::Vector3d>& pin_targets_m) {
  DRAPE_CHECK(!is_alive_ && model_ == nullptr, "a cloth begins once");
  is_alive_ = true;
  handle_ = handle;
  model_ = std::move(model);
  SetSettings(settings);
  shift_ = shift;
  Reset(pin_starts_m, pin_targets_m);
}

void ClothRuntime::Join(std::shared_ptr<ClothWorld> world, uint64_t id,
                        const Eigen::Vector3d& origin_m) {
  DRAPE_CHECK(is_alive_ && world_ == nullptr, "a cloth joins one world");
  world_ = std::move(world);
  world_->Join({this, id, origin_m});
  sleep_.Wake();
}

void ClothRuntime::End(const Status& reason) {
  is_alive_ = false;
  BeginLeaving();
  if (const std::shared_ptr<ClothWorld> world = world_) world->DropLeaving();
  for (ActiveRequest* request : turns_) request->EndWith(reason);
  RingBells();
}

void ClothRuntime::Hold() {
  DRAPE_CHECK(!is_held_, "one holds it at a time");
  is_held_ = true;
  for (ActiveRequest* request : turns_) request->AddHeldCloths(1);
}

void ClothRuntime::Release() {
  DRAPE_CHECK(is_held_, "it is held");
  is_held_ = false;
  for (ActiveRequest* request : turns_) request->AddHeldCloths(-1);
}

void ClothRuntime::Watch(const std::shared_ptr<ChangeBell>& bell, uint32_t index) {
  std::erase_if(watchers_, [](const Watcher& watcher) { return watcher.bell.expired(); });
  watchers_.push_back({bell, index});
}

void ClothRuntime::RingBells() {
  for (const Watcher& watcher : watchers_) {
    if (const std::shared_ptr<ChangeBell> bell = watcher.bell.lock()) bell->Ring(watcher.index);
  }
}

void ClothRuntime::TellChange() {
  published_.Publish(progress_);
  RingBells();
}

double ClothRuntime::TimeAfter_s(uint64_t completed_steps) const {
  return base_time_s_ + static_cast<double>(completed_steps - base_steps_) * time_step_s_;
}

double ClothRuntime::NextTime_s() const {
  return TimeAfter_s(progress_.completed_steps + 1);
}

void ClothRuntime::CompleteStep(const StepReport& report) {
  progress_.fault = report.fault;
  if (report.fault == FaultReason::kNone) {
    progress_.time_s = NextTime_s();
    ++progress_.completed_steps;
    ++state_version_;
    energy_ = report.energy.value_or(EnergyBalance{});
    progress_.warnings.Count(report.warnings);
    FollowBodies(report);
    const bool has_contacts = report.impulses != nullptr && report.impulses->contacts;
    contacts_ = has_contacts ? report.impulses : nullptr;
    contacts_version_ = state_version_;
    if (report.impulses != nullptr) {
      controls_.grips().OpenOverloaded(*report.impulses, time_step_s_);
    }
  }
  sleep_.CompleteStep(report);
  TellChange();
}

void ClothRuntime::FollowBodies(const StepReport& report) {
  if (report.bodies == nullptr) return;
  for (const BodyState& body : *report.bodies) {
    controls_.colliders().Follow(body.collider, body.motion, progress_.time_s);
  }
  controls_.ShowColliders();
}

void ClothRuntime::CompleteStepAsleep() {
  progress_.time_s = NextTime_s();
  ++progress_.completed_steps;
  progress_.warnings.Count(sleep_.report().warnings);
  TellChange();
}

StepReport ClothRuntime::Shifted(StepReport report) const {
  report.measured.lowest_m += shift_.lowest_m;
  report.measured.potential_energy_j += shift_.potential_energy_j;
  // With the least legal compliances it is more than a number can hold.
  constexpr double kMost_j = std::numeric_limits<float>::max();
  report.measured.strain_energy_j = std::min(report.measured.strain_energy_j, kMost_j);
  return report;
}

void ClothRuntime::Reset(const std::vector<Eigen::Vector3d>& pin_starts_m,
                         const std::vector<Eigen::Vector3d>& pin_targets_m) {
  DRAPE_CHECK(pin_starts_m.size() == model_->pin_count(), "one start per pin");
  progress_ = ClothProgress{};
  base_time_s_ = 0;
  base_steps_ = 0;
  energy_ = {};
  ++state_version_;
  ++reset_count_;
  controls_.Reset(pin_starts_m, pin_targets_m);
  sleep_.Wake();
  TellChange();
}

void ClothRuntime::Restate() {
  progress_.fault = FaultReason::kNone;
  energy_ = {};
  ++state_version_;
  sleep_.Wake();
  TellChange();
}

uint64_t RuntimeState::held_bytes() const {
  return pins.held_bytes() + grips.held_bytes() + lengths.held_bytes() + colliders.held_bytes() +
         sleep.held_bytes();
}

RuntimeState ClothRuntime::Save() const {
  RuntimeState state{.progress = progress_,
                     .time_step_s = time_step_s_,
                     .base_time_s = base_time_s_,
                     .base_steps = base_steps_,
                     .pins = controls_.pins(),
                     .grips = controls_.grips(),
                     .lengths = controls_.lengths(),
                     .colliders = controls_.colliders(),
                     .budget = budget_,
                     .sleep = sleep_,
                     .energy = energy_};
  // The targets of a step that did not end are known to the backend, but not to the state.
  if (is_in_pieces_ || is_faulted()) {
    state.pins.SendAgain();
    state.lengths.SendAgain();
  }
  return state;
}

void ClothRuntime::Restore(RuntimeState state) {
  progress_ = state.progress;
  time_step_s_ = state.time_step_s;
  base_time_s_ = state.base_time_s;
  base_steps_ = state.base_steps;
  controls_.pins() = std::move(state.pins);
  controls_.grips() = std::move(state.grips);
  controls_.lengths() = std::move(state.lengths);
  controls_.SetColliders(std::move(state.colliders));
  budget_ = state.budget;
  sleep_ = state.sleep;
  energy_ = state.energy;
  ++state_version_;
  ++reset_count_;
  TellChange();
}

void ClothRuntime::SetSettings(const StepSettings& settings) {
  SetTimeStep(settings.time_step_s);
  if (!(settings == budget_.settings())) cost_.Forget();
  budget_.Set(settings);
  sleep_.Set(settings);
}

void ClothRuntime::SetTimeStep(double time_step_s) {
  if (time_step_s == time_step_s_) return;
  contacts_ = nullptr;  // what forces they are is not known any more
  base_time_s_ = progress_.time_s;
  base_steps_ = progress_.completed_steps;
  time_step_s_ = time_step_s;
}

}  // namespace drape
