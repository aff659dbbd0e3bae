// A backend without physics that records its calls, for tests of the layers above the backends.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/scheduler/scheduler.h"
#include "server/solver/device_backend.h"
#include "tests/scheduler/awaited.h"
#include "tests/support/plain_settings.h"

namespace drape {

struct FakeItem {
  ClothHandle cloth;
  bool measure = false;
  std::vector<Eigen::Vector3d> pin_targets_m;
  uint32_t max_iterations = 0;  // as requested
  uint64_t world = 0;           // WorldPlace::world
};
using FakeBatch = std::vector<FakeItem>;

// The script of the fake backend and the record of its calls. Outlives the backend; thread-safe.
class FakeDevice {
  // First, because its result is deduced.
  template <class Function>
  auto Locked(Function function) const {
    const std::lock_guard lock(mutex_);
    return function();
  }

 public:
  // How many cloths fit.
  void SetCapacity(size_t cloths) {
    Locked([&] { capacity_ = cloths; });
  }
  // The `nth` (from 0) Write from now on fails with RESOURCE_EXHAUSTED, and `count` in all from
  // there on.
  void FailWrite(size_t nth, size_t count = 1) {
    Locked([&] {
      writes_to_pass_ = nth;
      writes_to_fail_ = count;
    });
  }
  // The next step of the cloth faults.
  void FaultNextStep(ClothHandle cloth) {
    Locked([&] { faults_.push_back(cloth); });
  }
  // CopyOnDevice makes copies from now on, whose life `copy` shows.
  void MakeCopies(std::shared_ptr<int> copy) {
    Locked([&] { copy_ = std::move(copy); });
  }
  // From now on it runs ahead, as far as callers can see: StepAhead calls its `meanwhile` when the
  // step is done.
  void RunAhead() {
    Locked([&] { runs_ahead_ = true; });
  }
  // What measuring cloths, and telling impulses, takes is made, or not yet.
  void SetReadyToMeasure(bool is_ready) {
    Locked([&] { is_ready_to_measure_ = is_ready; });
  }
  void SetReadyToTell(bool is_ready) {
    Locked([&] { is_ready_to_tell_ = is_ready; });
  }
  // Runs on the device thread in every Step, before anything else.
  void OnStep(std::function<void()> hook) {
    Locked([&] { on_step_ = std::move(hook); });
  }

  // Runs on the device thread in every Write, and in every Read, with the number of those before.
  void OnWrite(std::function<void(size_t)> hook) {
    Locked([&] { on_write_ = std::move(hook); });
  }
  void OnRead(std::function<void(size_t)> hook) {
    Locked([&] { on_read_ = std::move(hook); });
  }
  // Runs on the device thread for each item of a Step.
  void OnItem(std::function<void(ClothHandle)> hook) {
    Locked([&] { on_item_ = std::move(hook); });
  }
  // StepUntil leaves the next steps of these cloths undone, so many of each, after 200 ms of a
  // thread.
  void LeaveUndone(const std::vector<ClothHandle>& cloths, int times) {
    Locked([&] {
      for (const ClothHandle cloth : cloths) undone_[cloth.slot] = times;
    });
  }
  // Steps that are done in pieces take so many from now on.
  void StepInPieces(size_t pieces) {
    Locked([&] { pieces_per_step_ = pieces; });
  }
  // Calls of StepPiece since then, steps that have begun and are not complete, and those dropped.
  size_t pieces() const {
    return Locked([&] { return pieces_; });
  }
  size_t under_way() const {
    return Locked([&] { return under_way_.size(); });
  }
  size_t abandoned() const {
    return Locked([&] { return abandoned_; });
  }

  std::vector<FakeBatch> batches() const {
    return Locked([&] { return batches_; });
  }
  // Cloths of each Read.
  std::vector<size_t> reads() const {
    return Locked([&] { return reads_; });
  }
  // Of all of them together.
  size_t position_rows_read() const {
    return Locked([&] { return position_rows_read_; });
  }
  size_t live_cloths() const {
    return Locked([&] { return live_; });
  }
  size_t writes() const {
    return Locked([&] { return writes_; });
  }
  // The thread that made the backend.
  std::thread::id thread() const {
    return Locked([&] { return thread_; });
  }
  // Calls from any other thread, destruction included.
  size_t calls_on_wrong_thread() const {
    return Locked([&] { return wrong_thread_calls_; });
  }
  bool is_destroyed() const {
    return Locked([&] { return is_destroyed_; });
  }

 private:
  friend class FakeBackend;

  mutable std::mutex mutex_;
  size_t capacity_ = 1000000;
  size_t writes_to_pass_ = 0;
  size_t writes_to_fail_ = 0;  // then
  std::vector<ClothHandle> faults_;
  bool runs_ahead_ = false;
  bool is_ready_to_measure_ = true;
  bool is_ready_to_tell_ = true;
  std::function<void()> on_step_;
  std::function<void(ClothHandle)> on_item_;
  std::function<void(size_t)> on_write_;
  std::function<void(size_t)> on_read_;
  size_t pieces_per_step_ = 1;
  size_t pieces_ = 0;
  std::map<uint32_t, size_t> under_way_;  // pieces done, by slot
  std::map<uint32_t, int> undone_;        // steps to leave undone, by slot
  size_t abandoned_ = 0;
  std::vector<FakeBatch> batches_;
  std::vector<size_t> reads_;
  size_t position_rows_read_ = 0;
  size_t live_ = 0;
  size_t writes_ = 0;
  std::shared_ptr<int> copy_;
  std::thread::id thread_;
  size_t wrong_thread_calls_ = 0;
  bool is_destroyed_ = false;
};

// A step moves every free particle by (0, -1, 0) and every pin to its target. A batch is one
// dispatch. `measured.kinetic_energy_j` is the number of steps that the cloth has taken.
class FakeBackend final : public DeviceBackend {
 public:
  explicit FakeBackend(std::shared_ptr<FakeDevice> device) : device_(std::move(device)) {
    device_->Locked([&] { device_->thread_ = std::this_thread::get_id(); });
  }
  ~FakeBackend() override {
    CheckThread();
    device_->Locked([&] { device_->is_destroyed_ = true; });
  }

  BackendDescription Describe() const override {
    return {.name = "fake",
            .device = "no device",
            .scalar = ScalarType::kFloat64,
            .is_hardware_gpu = false,
            .plan_of = [](const SceneModel& model, const ClothParameters&) {
              return model.pin_count() > 0 ? "pinned" : "free";
            }};
  }

  Result<ClothHandle> Create(std::shared_ptr<const SceneModel> model,
                             const ClothParameters& parameters,
                             const ParticleState& state) override {
    CheckThread();
    if (cloths_.size() >= device_->Locked([&] { return device_->capacity_; })) return NoRoom();
    const ClothHandle handle{next_slot_++, 1};
    Cloth& cloth = cloths_[handle];
    cloth = {std::move(model), parameters, state, {}, FaultReason::kNone, 0, {}};
    for (const uint32_t p : cloth.model->pins()) {
      cloth.pin_targets_m.push_back(state.positions_m[p]);
    }
    device_->Locked([&] { ++device_->live_; });
    return handle;
  }

  void Destroy(ClothHandle handle) override {
    CheckThread();
    DRAPE_CHECK(cloths_.erase(handle) == 1, "the cloth exists");
    device_->Locked([&] { --device_->live_; });
  }

  BatchReport Step(std::span<const StepItem> items) override {
    CheckThread();
    const auto hook = device_->Locked([&] { return device_->on_step_; });
    if (hook) hook();
    const auto item_hook = device_->Locked([&] { return device_->on_item_; });
    for (const StepItem& item : items) {
      if (item_hook) item_hook(item.cloth);
    }
    BatchReport batch;
    batch.dispatch_count = 1;
    batch.upload_us = 1;
    batch.device_us = 10;
    batch.readback_us = 100;
    FakeBatch record;
    for (const StepItem& item : items) {
      record.push_back({item.cloth,
                        item.measure,
                        {item.pin_targets_m.begin(), item.pin_targets_m.end()},
                        item.max_iterations,
                        item.world.world});
      batch.reports.push_back(StepOne(item));
    }
    device_->Locked([&] { device_->batches_.push_back(std::move(record)); });
    return batch;
  }

  BatchReport StepUntil(std::span<const StepItem> items, const Pause& pause) override {
    if (pause.is_never()) return Step(items);
    std::vector<StepItem> done;
    std::vector<StepReport> reports(items.size());
    for (size_t k = 0; k < items.size(); ++k) {
      reports[k].is_undone =
          device_->Locked([&] { return device_->undone_[items[k].cloth.slot]-- > 0; });
      reports[k].thread_us = 2e5;
      if (!reports[k].is_undone) done.push_back(items[k]);
    }
    BatchReport batch = Step(done);
    size_t next = 0;
    for (StepReport& report : reports) {
      if (!report.is_undone) report = batch.reports[next++];
    }
    batch.reports = std::move(reports);
    return batch;
  }

  // The time of a step passes with its last piece.
  std::optional<BatchReport> StepPiece(std::span<const StepItem> items, const Pause&) override {
    CheckThread();
    const bool is_complete = device_->Locked([&] {
      ++device_->pieces_;
      if (++device_->under_way_[items[0].cloth.slot] < device_->pieces_per_step_) return false;
      device_->under_way_.erase(items[0].cloth.slot);
      return true;
    });
    if (!is_complete) return std::nullopt;
    return Step(items);
  }
  uint64_t LongStepBytes(std::span<const ClothHandle> cloths) override { return cloths.size(); }
  void AbandonStep(ClothHandle cloth) override {
    CheckThread();
    device_->Locked([&] { device_->abandoned_ += device_->under_way_.erase(cloth.slot); });
  }

  BatchReport StepAhead(std::span<const StepItem> items, const Pause& pause,
                        const std::function<void()>& meanwhile) override {
    BatchReport batch = StepUntil(items, pause);
    meanwhile();
    return batch;
  }
  bool RunsAhead() const override {
    return device_->Locked([&] { return device_->runs_ahead_; });
  }

  StateColumns Read(const ReadRequest& request) override {
    CheckThread();
    const auto hook = device_->Locked([&] { return device_->on_read_; });
    if (hook) hook(device_->reads().size());
    StateColumns columns;
    if (request.positions) {
      columns.positions_m = Column(request, &ParticleState::positions_m);
    }
    if (request.velocities) {
      columns.velocities_m_per_s = Column(request, &ParticleState::velocities_m_per_s);
    }
    device_->Locked([&] {
      device_->reads_.push_back(request.cloths.size());
      if (!request.positions) return;
      for (const ClothHandle handle : request.cloths) {
        device_->position_rows_read_ +=
            RowsOf(request.particles, cloths_.at(handle).model->particle_count());
      }
    });
    return columns;
  }

  bool IsReadyToMeasure() override {
    CheckThread();
    return device_->Locked([&] { return device_->is_ready_to_measure_; });
  }
  bool IsReadyToTellImpulses(ClothHandle handle) override {
    CheckThread();
    DRAPE_CHECK(cloths_.contains(handle), "the cloth exists");
    return device_->Locked([&] { return device_->is_ready_to_tell_; });
  }

  std::unique_ptr<PendingRead> BeginRead(const ReadRequest& request) override {
    return std::make_unique<CompletedRead>(Read(request));
  }

  std::shared_ptr<DeviceCopy> CopyOnDevice(const ReadRequest&) override {
    CheckThread();
    const auto copy = device_->Locked([&] { return device_->copy_; });
    if (copy == nullptr) return nullptr;
    // Has no content: only its lifetime counts.
    return {copy, reinterpret_cast<DeviceCopy*>(copy.get())};
  }

  Status Write(ClothHandle handle, const ClothUpdate& update) override {
    CheckThread();
    const auto hook = device_->Locked([&] { return device_->on_write_; });
    if (hook) hook(device_->writes());
    const bool fails = device_->Locked([&] {
      ++device_->writes_;
      if (device_->writes_to_fail_ == 0) return false;
      if (device_->writes_to_pass_ > 0) {
        --device_->writes_to_pass_;
        return false;
      }
      --device_->writes_to_fail_;
      return true;
    });
    if (fails) return NoRoom();
    Cloth& cloth = cloths_.at(handle);
    if (update.model != nullptr) cloth.model = update.model;
    if (update.model != nullptr || update.rest_lengths_m.has_value()) {
      cloth.rest_lengths_m = update.rest_lengths_m.value_or(std::vector<double>{});
    }
    if (update.parameters.has_value()) cloth.parameters = *update.parameters;
    if (update.collider_motions) cloth.parameters.collider_motions = *update.collider_motions;
    if (update.pin_targets_m.has_value()) cloth.pin_targets_m = *update.pin_targets_m;
    if (update.state.has_value()) {
      cloth.state = *update.state;
      cloth.fault = update.fault;
      cloth.steps = 0;
    }
    DRAPE_CHECK(cloth.pin_targets_m.size() == cloth.model->pin_count(), "one target per pin");
    return Status::Ok();
  }

  // For tests that look inside, on the device thread.
  const ClothParameters& ParametersOf(ClothHandle handle) const {
    return cloths_.at(handle).parameters;
  }
  const std::shared_ptr<const SceneModel>& ModelOf(ClothHandle handle) const {
    return cloths_.at(handle).model;
  }
  const std::vector<Eigen::Vector3d>& PinTargetsOf(ClothHandle handle) const {
    return cloths_.at(handle).pin_targets_m;
  }
  // Rest lengths of its own; empty: those of the model.
  const std::vector<double>& LengthsOf(ClothHandle handle) const {
    return cloths_.at(handle).rest_lengths_m;
  }
  const ParticleState& StateOf(ClothHandle handle) const { return cloths_.at(handle).state; }

 private:
  struct Cloth {
    std::shared_ptr<const SceneModel> model;
    ClothParameters parameters = test::PlainParameters();
    ParticleState state;
    std::vector<Eigen::Vector3d> pin_targets_m;
    FaultReason fault = FaultReason::kNone;
    uint64_t steps = 0;
    std::vector<double> rest_lengths_m{};
  };

  static Status NoRoom() {
    return {StatusCode::kResourceExhausted, "DEVICE_FULL", "the fake device is full"};
  }

  void CheckThread() const {
    device_->Locked(
        [&] { device_->wrong_thread_calls_ += device_->thread_ != std::this_thread::get_id(); });
  }

  bool TakeFault(ClothHandle handle) {
    return device_->Locked([&] { return std::erase(device_->faults_, handle) > 0; });
  }

  StepReport StepOne(const StepItem& item) {
    Cloth& cloth = cloths_.at(item.cloth);
    StepReport report;
    if (cloth.fault == FaultReason::kNone && TakeFault(item.cloth)) {
      cloth.fault = FaultReason::kNotFinite;
    }
    report.fault = cloth.fault;
    if (cloth.fault == FaultReason::kNone) {
      if (!item.pin_targets_m.empty()) {
        cloth.pin_targets_m.assign(item.pin_targets_m.begin(), item.pin_targets_m.end());
      }
      if (!item.rest_lengths_m.empty()) {
        DRAPE_CHECK(cloth.rest_lengths_m.size() == item.rest_lengths_m.size(), "it has its own");
        cloth.rest_lengths_m.assign(item.rest_lengths_m.begin(), item.rest_lengths_m.end());
      }
      DRAPE_CHECK(item.collider_motions.size() == cloth.parameters.collider_motions.size(),
                  "the motions of every step are given");
      cloth.parameters.collider_motions.assign(item.collider_motions.begin(),
                                               item.collider_motions.end());
      for (Eigen::Vector3d& p : cloth.state.positions_m) p.y() -= 1;
      size_t k = 0;
      for (const uint32_t pin : cloth.model->pins()) {
        cloth.state.positions_m[pin] = cloth.pin_targets_m[k++];
      }
      ++cloth.steps;
      report.iterations = 1;
      report.warnings.not_converged = true;
    }
    if (item.measure) report.measured.kinetic_energy_j = static_cast<double>(cloth.steps);
    return report;
  }

  std::vector<double> Column(const ReadRequest& request,
                             std::vector<Eigen::Vector3d> ParticleState::*member) const {
    std::vector<double> column;
    for (const ClothHandle handle : request.cloths) {
      const std::vector<Eigen::Vector3d>& vectors = cloths_.at(handle).state.*member;
      const uint32_t rows = RowsOf(request.particles, static_cast<uint32_t>(vectors.size()));
      for (uint32_t row = 0; row < rows; ++row) {
        const Eigen::Vector3d& v =
            vectors.at(request.particles.empty() ? row : request.particles[row]);
        column.insert(column.end(), {v.x(), v.y(), v.z()});
      }
    }
    return column;
  }

  std::shared_ptr<FakeDevice> device_;
  std::unordered_map<ClothHandle, Cloth> cloths_;
  uint32_t next_slot_ = 0;
};

inline BackendFactory FakeBackendFactory(std::shared_ptr<FakeDevice> device) {
  return [device]() -> Result<std::unique_ptr<Backend>> {
    return std::unique_ptr<Backend>(std::make_unique<FakeBackend>(device));
  };
}

// A chain of particles along +x, 1 m apart, 1 kg each.
inline ModelDescription ChainDescription(uint32_t particles, std::vector<uint32_t> pinned = {}) {
  ParticleTopology chain;
  for (uint32_t p = 0; p < particles; ++p) {
    chain.positions_m.emplace_back(p, 0, 0);
    chain.masses_kg.push_back(1);
    if (p > 0) chain.distance_constraints.push_back({p - 1, p, 1, 0});
  }
  ModelDescription description;
  description.topology = std::move(chain);
  description.pinned_particles = std::move(pinned);
  return description;
}

inline std::shared_ptr<const SceneModel> ChainModel(uint32_t particles,
                                                    std::vector<uint32_t> pinned = {}) {
  return SceneModel::Build(ChainDescription(particles, std::move(pinned))).value();
}

// Creates a cloth at rest in the model's rest shape, pins where they are. On the device thread.
inline std::shared_ptr<ClothRuntime> BeginCloth(Backend& backend,
                                                const std::shared_ptr<const SceneModel>& model,
                                                double time_step_s = 0.25) {
  ParticleState state;
  state.positions_m.assign(model->rest_positions_m().begin(), model->rest_positions_m().end());
  state.velocities_m_per_s.assign(model->particle_count(), Eigen::Vector3d::Zero());
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.time_step_s = time_step_s;
  const ClothHandle handle = backend.Create(model, parameters, state).value();
  std::vector<Eigen::Vector3d> pins_m;
  for (const uint32_t p : model->pins()) pins_m.push_back(state.positions_m[p]);
  auto runtime = std::make_shared<ClothRuntime>();
  runtime->Begin(handle, model, parameters.settings, ReportShift{}, pins_m, pins_m);
  return runtime;
}

}  // namespace drape
