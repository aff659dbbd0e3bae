#include "server/solver/gl_compute/gl_backend.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <bit>
#include <optional>
#include <unordered_map>
#include <utility>

#include "server/core/device_loss.h"
#include "server/gl/device_copy.h"
#include "server/solver/energy_watch.h"
#include "server/solver/gl_compute/cloth_room.h"
#include "server/solver/gl_compute/cloth_table.h"
#include "server/solver/gl_compute/cloth_words.h"
#include "server/solver/gl_compute/gl_cloth.h"
#include "server/solver/gl_compute/gl_device.h"
#include "server/solver/gl_compute/gl_read.h"
#include "server/solver/gl_compute/impulse_read.h"
#include "server/solver/gl_compute/kernel_compiler.h"
#include "server/solver/gl_compute/kernel_variant.h"
#include "server/solver/gl_compute/packing.h"
#include "server/solver/gl_compute/self_contact_measures.h"
#include "server/solver/gl_compute/step_batch.h"
#include "server/solver/gl_compute/tiled_step.h"
#include "server/solver/update_check.h"

namespace drape {
namespace {

using Eigen::Vector3d;

class GlBackend final : public DeviceBackend {
 public:
  explicit GlBackend(GlDevice device)
      : device_(std::move(device)),
        rooms_(&device_),
        compiler_(std::make_shared<KernelCompiler>(device_.kernels.get(),
                                                   device_.context->share_handle(), device_.traits,
                                                   device_.measure.All())) {}

  ~GlBackend() override {
    compiler_->Stop();
    device_.context->MakeCurrent();
  }

  BackendDescription Describe() const override {
    const gl::Context& context = *device_.context;
    const StripSolve strip_solve = device_.traits.strip_solve;
    const char* strips = IsReduction(strip_solve)                   ? ", strips by cyclic reduction"
                         : strip_solve == StripSolve::kFromBothEnds ? ", strips from both ends"
                                                                    : "";
    const std::string device = context.renderer() + ", OpenGL " + context.version() + strips;
    return {.name = "gl",
            .device = device,
            .arithmetic = device,
            .is_hardware_gpu = !context.is_software(),
            .can_step = KernelsCanStep,
            .plan_of = KernelPlan,
            .prepare = [compiler = compiler_](const auto& model, const auto& parameters) {
              compiler->Prepare(model, parameters);
            }};
  }

  Result<ClothHandle> Create(std::shared_ptr<const SceneModel> model,
                             const ClothParameters& parameters,
                             const ParticleState& state) override;
  void Destroy(ClothHandle handle) override;
  BatchReport Step(std::span<const StepItem> items) override {
    return StepAhead(items, Pause::Never(), nullptr);
  }
  BatchReport StepAhead(std::span<const StepItem> items, const Pause&,
                        const std::function<void()>& meanwhile) override;
  std::optional<BatchReport> StepPiece(std::span<const StepItem> items,
                                       const Pause& pause) override;
  void AbandonStep(ClothHandle handle) override;
  bool RunsAhead() const override { return device_.runs_ahead; }
  StateColumns Read(const ReadRequest& request) override { return BeginRead(request)->Take(); }
  bool IsReadyToMeasure() override { return compiler_->AreOthersReady(); }
  bool IsReadyToTellImpulses(ClothHandle handle) override {
    const GlCloth& cloth = cloths_.Find(handle);
    return cloth.impulses.is_made() || compiler_->IsCompiled(VariantThatTells(cloth));
  }
  std::unique_ptr<PendingRead> BeginRead(const ReadRequest& request) override;
  std::shared_ptr<DeviceCopy> CopyOnDevice(const ReadRequest& request) override;
  Status Write(ClothHandle handle, const ClothUpdate& update) override;
  bool MayCrossItself(ClothHandle handle) override { return cloths_.Find(handle).may_cross_itself; }

 private:
  void Occupy(GlCloth& cloth, ClothRoom room, const ClothParameters& parameters);
  // Targets of the pins of `model`: those that stay keep theirs, new ones start where they are.
  std::vector<uint32_t> CarryTargets(const GlCloth& cloth, const SceneModel& model);
  void WriteState(GlCloth& cloth, const ParticleState& state,
                  FaultReason fault = FaultReason::kNone);
  // Between the usual scheme of a cloth and its calmer one.
  void UseCalmerScheme(ClothHandle handle);
  void UseUsualScheme(ClothHandle handle);
  // What a step that must be done again needs.
  void PrepareToStepAgain(ClothHandle handle);
  std::vector<float> ReadPositions(const GlCloth& cloth) {
    return ReadColumn(cloth.state.begin(), 3 * cloth.particle_count());
  }
  // Of a cloth that touches itself and begins a step: what crosses.
  void FindCrossingParts(GlCloth& cloth);
  void MeasureSelfContacts(std::span<const StepItem> items, BatchReport& report);
  // Room for the impulses of a cloth; what steps gave, while the schemes are those of the steps.
  bool HasRoomForImpulses(ClothHandle handle);
  void ReadImpulses(std::span<const StepItem> items, BatchReport& report);
  // Steps those of the items again that must be.
  void StepAgain(std::span<const StepItem> items, BatchReport& report);
  // What a step that begins is told; not of a faulted cloth.
  void SetTargets(const StepItem& item, GlCloth& cloth);
  // Every state on the device is lost with a reset; only a new process can use a device again.
  void CheckForReset() {
    const std::string reset_reason = device_.context->ResetReason();
    if (!reset_reason.empty()) LoseDevice(reset_reason);
  }
  void WriteRecord(uint32_t slot);
  ClothWords Words() { return ClothWords(device_.arrays->parameters); }
  std::vector<float> ReadColumn(uint32_t begin, uint32_t count);
  // All positions, then all velocities, of whole cloths.
  std::vector<StateColumn> ColumnsOf(const ReadRequest& request);

  GlDevice device_;
  RoomMaker rooms_;
  GlClothTable cloths_;
  std::shared_ptr<KernelCompiler> compiler_;  // never used once this is destroyed
  // A step in pieces, and the lengths at which it began.
  struct StepUnderWay {
    LongStep step;
    std::vector<uint32_t> length_words;
  };
  std::unordered_map<ClothHandle, StepUnderWay> steps_under_way_;
};

void GlBackend::Occupy(GlCloth& cloth, ClothRoom room, const ClothParameters& parameters) {
  cloth.scheme() = std::move(room.scheme);
  cloth.gain_response =
      HasCalmerScheme(cloth.plan) ? GainResponse::kStepAgain : GainResponse::kWarn;
  cloth.other_scheme.reset();
  cloth.model = std::move(room.model);
  cloth.maps = std::move(room.maps);
  cloth.parameter_words = std::move(room.parameter_words);
  cloth.parameter_layout = room.parameter_layout;
  cloth.contact_words = std::move(room.contact_words);
  cloth.pair_capacity = room.pair_capacity;
  cloth.may_take_more_pairs = true;
  cloth.tells_impulses = cloth.has_warned_of_room = false;
  cloth.crossing_flags.clear();
  cloth.parameters = parameters;
  cloth.max_iterations = parameters.settings.max_iterations;
  Words().WriteElastic(cloth);
  Words().OpenGrips(cloth);
}

void GlBackend::WriteState(GlCloth& cloth, const ParticleState& state, FaultReason fault) {
  device_.arrays->states.Write(cloth.state, 0, std::span<const float>(PackState(state)));
  cloth.fault = fault;
}

void GlBackend::WriteRecord(uint32_t slot) {
  GlCloth& cloth = cloths_.AtSlot(slot);
  cloth.motion_words.clear();
  Words().WriteMotions(cloth, cloth.parameters.collider_motions);
  Words().WriteColliders(cloth);
  Words().WriteSelfContacts(cloth);
  Words().WriteImpulses(cloth);
  const shader::ClothRecord record = MakeClothRecord(cloth);
  device_.arrays->cloths.Write(slot * sizeof(record), std::as_bytes(std::span(&record, 1)));
}

Result<ClothHandle> GlBackend::Create(std::shared_ptr<const SceneModel> model,
                                      const ClothParameters& parameters,
                                      const ParticleState& state) {
  DRAPE_RETURN_IF_ERROR(CheckStateFits(*model, parameters, state));
  device_.context->MakeCurrent();
  DeviceArrays& arrays = *device_.arrays;
  Result<WordRange> state_words = arrays.states.Allocate(6 * uint64_t{model->particle_count()});
  if (!state_words.ok()) return state_words.status();
  Result<ClothRoom> room = rooms_.Make(model, parameters, LengthSource::kModel, cloths_.count());
  if (!room.ok()) return room.status();
  DRAPE_RETURN_IF_ERROR(
      arrays.cloths.Reserve((cloths_.slot_count() + 1) * sizeof(shader::ClothRecord)));
  // From here on nothing can fail.
  GlCloth cloth{{.plan = room->scheme.plan}};
  cloth.state = std::move(state_words).value();
  Occupy(cloth, std::move(room).value(), parameters);
  WriteState(cloth, state);
  Words().WriteTargets(cloth, PackTargets(PinPositions(*cloth.model->model, state)));
  const ClothHandle handle = cloths_.Add(std::move(cloth));
  WriteRecord(handle.slot);
  return handle;
}

void GlBackend::Destroy(ClothHandle handle) {
  device_.context->MakeCurrent();
  steps_under_way_.erase(handle);
  cloths_.Remove(handle);
}

std::vector<float> GlBackend::ReadColumn(uint32_t begin, uint32_t count) {
  std::vector<float> words(count);
  const StateColumn column{begin, count};
  device_.reader->Begin(device_.arrays->states.buffer(), {&column, 1}).Take({words});
  return words;
}

std::vector<uint32_t> GlBackend::CarryTargets(const GlCloth& cloth, const SceneModel& model) {
  const std::span<const uint32_t> old_pins = cloth.model->model->pins();
  const std::vector<uint32_t> old_targets =
      device_.arrays->parameters.Read(cloth.parameter_words, 0, 3 * cloth.pin_count());
  const std::vector<float> positions = ReadColumn(cloth.state.begin(), 3 * cloth.particle_count());
  std::vector<uint32_t> targets;
  for (const uint32_t pin : model.pins()) {
    const auto old = std::lower_bound(old_pins.begin(), old_pins.end(), pin);
    const bool is_kept = old != old_pins.end() && *old == pin;
    const size_t old_word = 3 * static_cast<size_t>(old - old_pins.begin());
    for (size_t axis = 0; axis < 3; ++axis) {
      targets.push_back(is_kept ? old_targets[old_word + axis]
                                : std::bit_cast<uint32_t>(positions[3 * pin + axis]));
    }
  }
  return targets;
}

Status GlBackend::Write(ClothHandle handle, const ClothUpdate& update) {
  device_.context->MakeCurrent();
  AbandonStep(handle);
  GlCloth& cloth = cloths_.Find(handle);
  const std::shared_ptr<const SceneModel> model = update.model ? update.model : cloth.model->model;
  DRAPE_RETURN_IF_ERROR(CheckUpdateFits(*cloth.model->model, cloth.parameters, update));
  if (update.model || update.parameters || update.rest_lengths_m || update.collider_motions) {
    std::vector<uint32_t> lengths = update.model ? std::vector<uint32_t>{} : cloth.length_words;
    if (update.rest_lengths_m) lengths = PackLengths(*update.rest_lengths_m);
    ClothParameters parameters = update.parameters.value_or(cloth.parameters);
    if (update.collider_motions) parameters.collider_motions = *update.collider_motions;
    Result<ClothRoom> room =
        rooms_.Make(model, parameters, lengths.empty() ? LengthSource::kModel : LengthSource::kOwn,
                    cloths_.count());
    if (!room.ok()) return room.status();
    // From here on nothing can fail.
    if (update.state) WriteState(cloth, *update.state, update.fault);
    const std::vector<uint32_t> targets = CarryTargets(cloth, *model);
    Occupy(cloth, std::move(room).value(), parameters);
    Words().WriteTargets(cloth, targets);
    cloth.length_words = std::move(lengths);
    cloth.are_lengths_moving = false;
    if (cloth.has_own_lengths()) Words().WriteLengths(cloth, cloth.length_words);
    WriteRecord(handle.slot);
  } else if (update.state) {
    WriteState(cloth, *update.state, update.fault);
  }
  if (update.pin_targets_m) Words().WriteTargets(cloth, PackTargets(*update.pin_targets_m));
  cloth.may_cross_itself = update.may_cross_itself;
  return Status::Ok();
}

void GlBackend::SetTargets(const StepItem& item, GlCloth& cloth) {
  if (!item.pin_targets_m.empty()) Words().WriteTargets(cloth, PackTargets(item.pin_targets_m));
  Words().SetLengthTargets(cloth, item.rest_lengths_m);
  Words().WriteGrips(cloth, item.grips);
  if (!item.collider_motions.empty()) {
    DRAPE_CHECK(HasMovingColliders(cloth.parameters),
                "only a cloth with moving colliders has motions");
    cloth.parameters.collider_motions.assign(item.collider_motions.begin(),
                                             item.collider_motions.end());
  }
  Words().WriteMotions(cloth, cloth.parameters.collider_motions);
  const uint32_t max_iterations = IterationsOf(item, cloth.parameters.settings);
  const bool tells_contacts = item.impulses && item.contact_impulses;
  bool is_other = std::exchange(cloth.max_iterations, max_iterations) != max_iterations;
  is_other |= std::exchange(cloth.tells_contacts, tells_contacts) != tells_contacts;
  if (is_other) WriteRecord(item.cloth.slot);
  cloth.tells_impulses = item.impulses && HasRoomForImpulses(item.cloth);
  FindCrossingParts(cloth);
}

BatchReport GlBackend::StepAhead(std::span<const StepItem> items, const Pause&,
                                 const std::function<void()>& meanwhile) {
  device_.context->MakeCurrent();
  for (const StepItem& item : items) {
    AbandonStep(item.cloth);
    GlCloth& cloth = cloths_.Find(item.cloth);
    if (cloth.fault == FaultReason::kNone) SetTargets(item, cloth);
  }
  BatchReport report = RunBatch(items, cloths_, *device_.arrays, device_.measure, device_.batch,
                                device_.runs_ahead ? meanwhile : nullptr);
  StepAgain(items, report);
  ReadImpulses(items, report);
  for (const StepItem& item : items) UseUsualScheme(item.cloth);
  MeasureSelfContacts(items, report);
  for (const StepItem& item : items) Words().EndMotions(cloths_.Find(item.cloth));
  CheckForReset();
  return report;
}

void GlBackend::UseCalmerScheme(ClothHandle handle) {
  GlCloth& cloth = cloths_.Find(handle);
  cloth.must_step_again = false;
  if (!cloth.other_scheme) {
    const ClothParameters calmer = WithCalmerScheme(cloth.parameters);
    Result<GlScheme> scheme = rooms_.MakeScheme(PlanOnDevice(*cloth.model->model, calmer),
                                                *cloth.model, cloth.pair_capacity);
    if (scheme.ok()) cloth.other_scheme = std::move(scheme).value();
  }
  if (cloth.other_scheme) {
    std::swap(cloth.scheme(), *cloth.other_scheme);
    cloth.gain_response = GainResponse::kNotWatched;
    Words().WriteElastic(cloth);
    if (cloth.tells_impulses) cloth.tells_impulses = HasRoomForImpulses(handle);
  } else {
    spdlog::warn("energy_gained_without_room_to_step_again particles={}", cloth.particle_count());
    cloth.gain_response = GainResponse::kWarn;
  }
  WriteRecord(handle.slot);
}

void GlBackend::UseUsualScheme(ClothHandle handle) {
  GlCloth& cloth = cloths_.Find(handle);
  if (cloth.gain_response != GainResponse::kNotWatched) return;
  std::swap(cloth.scheme(), *cloth.other_scheme);
  cloth.gain_response = GainResponse::kStepAgain;
  Words().WriteElastic(cloth);
  WriteRecord(handle.slot);
}

void GlBackend::PrepareToStepAgain(ClothHandle handle) {
  if (cloths_.Find(handle).pairs_wanted > 0) {
    rooms_.TakeMorePairs(cloths_.Find(handle));
    WriteRecord(handle.slot);
  } else {
    UseCalmerScheme(handle);
  }
}

void GlBackend::FindCrossingParts(GlCloth& cloth) {
  if (!cloth.touches_itself()) return;
  std::vector<uint32_t> flags;
  if (cloth.may_cross_itself) flags = FlagCrossings(*cloth.model->surface, ReadPositions(cloth));
  if (flags == cloth.crossing_flags) return;
  cloth.crossing_flags = std::move(flags);
  Words().WriteSelfContacts(cloth);
}

void GlBackend::MeasureSelfContacts(std::span<const StepItem> items, BatchReport& report) {
  for (size_t k = 0; k < items.size(); ++k) {
    const GlCloth& cloth = cloths_.Find(items[k].cloth);
    if (!items[k].measure || !cloth.touches_itself()) continue;
    AddSelfContacts(*cloth.model->surface, cloth.parameters, ReadPositions(cloth),
                    report.reports[k].measured);
  }
}

void GlBackend::StepAgain(std::span<const StepItem> items, BatchReport& report) {
  while (true) {
    std::vector<StepItem> again;
    std::vector<size_t> places;
    for (size_t k = 0; k < items.size(); ++k) {
      if (!cloths_.Find(items[k].cloth).must_be_redone()) continue;
      PrepareToStepAgain(items[k].cloth);
      again.push_back(items[k]);
      places.push_back(k);
    }
    if (again.empty()) break;
    const BatchReport redone =
        RunBatch(again, cloths_, *device_.arrays, device_.measure, device_.batch, nullptr);
    for (size_t k = 0; k < again.size(); ++k) report.reports[places[k]] = redone.reports[k];
    report.dispatch_count += redone.dispatch_count;
    report.upload_us += redone.upload_us;
    report.device_us += redone.device_us;
    report.readback_us += redone.readback_us;
  }
}

bool GlBackend::HasRoomForImpulses(ClothHandle handle) {
  GlCloth& cloth = cloths_.Find(handle);
  if (cloth.impulses.is_made()) return true;
  const Status made = rooms_.MakeImpulses(cloth);
  if (made.ok()) {
    WriteRecord(handle.slot);
  } else if (!std::exchange(cloth.has_warned_of_room, true)) {
    spdlog::warn("impulses_without_room particles={} reason=\"{}\"", cloth.particle_count(),
                 made.message());
  }
  return made.ok();
}

void GlBackend::ReadImpulses(std::span<const StepItem> items, BatchReport& report) {
  std::vector<const GlCloth*> cloths;
  std::vector<StepReport*> reports;
  for (size_t k = 0; k < items.size(); ++k) {
    const GlCloth& cloth = cloths_.Find(items[k].cloth);
    if (!items[k].impulses || report.reports[k].fault != FaultReason::kNone) continue;
    cloths.push_back(&cloth);
    reports.push_back(&report.reports[k]);
  }
  const auto impulses = drape::ReadImpulses(cloths, *device_.arrays, *device_.reader);
  for (size_t k = 0; k < reports.size(); ++k) reports[k]->impulses = impulses[k];
}

std::optional<BatchReport> GlBackend::StepPiece(std::span<const StepItem> items,
                                                const Pause& pause) {
  DRAPE_CHECK(items.size() == 1, "the kernels step no worlds");
  const StepItem& item = items[0];
  device_.context->MakeCurrent();
  GlCloth& cloth = cloths_.Find(item.cloth);
  if (cloth.fault != FaultReason::kNone) return Step({&item, 1});
  const auto [under_way, is_new] =
      steps_under_way_.try_emplace(item.cloth, StepUnderWay{{}, cloth.length_words});
  if (is_new) SetTargets(item, cloth);
  LongStep& step = under_way->second.step;
  auto report =
      RunPiece(item, cloths_, *device_.arrays, device_.measure, device_.batch, step, pause);
  while (report && cloth.must_be_redone()) {
    PrepareToStepAgain(item.cloth);
    step = {};
    if (!pause.is_never() && pause.IsDue()) return std::nullopt;
    report = RunPiece(item, cloths_, *device_.arrays, device_.measure, device_.batch, step, pause);
  }
  CheckForReset();
  if (!report) return std::nullopt;
  ReadImpulses({&item, 1}, *report);
  UseUsualScheme(item.cloth);
  MeasureSelfContacts({&item, 1}, *report);
  Words().EndMotions(cloth);
  steps_under_way_.erase(under_way);
  return report;
}

void GlBackend::AbandonStep(ClothHandle handle) {
  const auto under_way = steps_under_way_.find(handle);
  if (under_way == steps_under_way_.end()) return;
  GlCloth& cloth = cloths_.Find(handle);
  UseUsualScheme(handle);
  cloth.are_lengths_moving = cloth.has_own_lengths();  // the device has others
  cloth.length_words = std::move(under_way->second.length_words);
  steps_under_way_.erase(under_way);
}

std::vector<StateColumn> GlBackend::ColumnsOf(const ReadRequest& request) {
  std::vector<StateColumn> columns;
  for (const bool velocities : {false, true}) {
    if (!(velocities ? request.velocities : request.positions)) continue;
    for (const ClothHandle handle : request.cloths) {
      const GlCloth& cloth = cloths_.Find(handle);
      const uint32_t count = 3 * cloth.particle_count();
      columns.push_back({cloth.state.begin() + (velocities ? count : 0), count});
    }
  }
  return columns;
}

std::unique_ptr<PendingRead> GlBackend::BeginRead(const ReadRequest& request) {
  device_.context->MakeCurrent();
  RowPlan plan(request.particles);
  size_t words = 0;
  for (const ClothHandle handle : request.cloths) {
    words += plan.AddCloth(cloths_.Find(handle).particle_count());
  }
  StateTransfer transfer =
      device_.reader->Begin(device_.arrays->states.buffer(), ColumnsOf(request), plan.runs());
  return std::make_unique<GlRead>(*device_.context, std::move(transfer), std::move(plan),
                                  request.positions ? words : 0, request.velocities ? words : 0);
}

std::shared_ptr<DeviceCopy> GlBackend::CopyOnDevice(const ReadRequest& request) {
  DRAPE_CHECK(request.particles.empty(), "copies are of whole cloths");
  device_.context->MakeCurrent();
  const std::vector<StateColumn> columns = ColumnsOf(request);
  size_t bytes = 0;
  for (const StateColumn& column : columns) bytes += column.count * sizeof(float);
  if (bytes == 0) return nullptr;
  Result<gl::Buffer> buffer = gl::Buffer::Create(bytes);
  if (!buffer.ok()) return nullptr;
  // Steps wrote the states with shaders.
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  size_t target = 0;
  for (const StateColumn& column : columns) {
    const size_t column_bytes = column.count * sizeof(float);
    buffer->CopyFrom(device_.arrays->states.buffer(), column.begin * sizeof(float), target,
                     column_bytes);
    target += column_bytes;
  }
  return std::make_shared<DeviceCopy>(DeviceCopy{std::move(buffer).value(), gl::Fence::Insert()});
}

}  // namespace

Result<std::unique_ptr<Backend>> CreateGlBackend(const GlBackendOptions& options) {
  return CreateTunedGlBackend(options, {});
}

Result<std::unique_ptr<Backend>> CreateTunedGlBackend(const GlBackendOptions& options,
                                                      const GlTuning& tuning) {
  DRAPE_ASSIGN_OR_RETURN(GlDevice device, GlDevice::Open(options, tuning));
  return std::unique_ptr<Backend>(std::make_unique<GlBackend>(std::move(device)));
}

}  // namespace drape
