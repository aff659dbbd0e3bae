#include "server/solver/gl_compute/gl_backend.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <bit>
#include <utility>

#include "server/gl/device_copy.h"
#include "server/solver/gl_compute/cloth_table.h"
#include "server/solver/gl_compute/device_arrays.h"
#include "server/solver/gl_compute/gl_cloth.h"
#include "server/solver/gl_compute/gl_read.h"
#include "server/solver/gl_compute/kernels.h"
#include "server/solver/gl_compute/state_reader.h"
#include "server/solver/gl_compute/step_batch.h"
#include "server/solver/gl_compute/step_plans.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

using Eigen::Vector3d;

class GlBackend final : public DeviceBackend {
 public:
  // Members in order of construction.
  struct Parts {
    std::unique_ptr<gl::Context> context;
    std::unique_ptr<DeviceArrays> arrays;
    std::unique_ptr<KernelCache> kernels;
    std::unique_ptr<StateReader> reader;
    MeasureKernels measure;
    DeviceTraits traits;
    BatchDevice device;
    bool runs_ahead = false;
  };

  explicit GlBackend(Parts parts)
      : parts_(std::move(parts)), models_(&parts_.arrays->models), maps_(&parts_.arrays->models) {}

  ~GlBackend() override { parts_.context->MakeCurrent(); }

  BackendDescription Describe() const override {
    const gl::Context& context = *parts_.context;
    const bool has_reduction = parts_.traits.strip_solve != StripSolve::kElimination;
    return {.name = "gl",
            .device = context.renderer() + ", OpenGL " + context.version() +
                      (has_reduction ? ", strips by cyclic reduction" : ""),
            .scalar = ScalarType::kFloat32,
            .is_hardware_gpu = !context.is_software(),
            .plan_of = [](const SceneModel& model) {
              return IsResident(model) ? "resident" : "tiled";
            }};
  }

  Result<ClothHandle> Create(std::shared_ptr<const SceneModel> model,
                             const ClothParameters& parameters,
                             const ParticleState& state) override;
  void Destroy(ClothHandle handle) override;
  BatchReport Step(std::span<const StepItem> items) override { return StepAhead(items, nullptr); }
  BatchReport StepAhead(std::span<const StepItem> items,
                        const std::function<void()>& meanwhile) override;
  bool RunsAhead() const override { return parts_.runs_ahead; }
  StateColumns Read(const ReadRequest& request) override { return BeginRead(request)->Take(); }
  std::unique_ptr<PendingRead> BeginRead(const ReadRequest& request) override;
  std::shared_ptr<DeviceCopy> CopyOnDevice(const ReadRequest& request) override;
  Status Write(ClothHandle handle, const ClothUpdate& update) override;

 private:
  // What a cloth needs on the device for a model and parameters.
  struct Room {
    std::shared_ptr<const DeviceModel> model;
    std::vector<std::shared_ptr<const DeviceMap>> maps;
    const StepKernels* kernels = nullptr;
    uint64_t part_count = 1;
    WordRange parameter_words;
    WordRange scratch;
  };
  // The kernels of a cloth, its parts: a function of the cloth and the device.
  Status ChooseKernels(const SceneModel& model, const ClothParameters& parameters,
                       bool has_own_lengths, Room& room);
  Result<Room> MakeRoom(std::shared_ptr<const SceneModel> model, const ClothParameters& parameters,
                        bool has_own_lengths = false);
  static void Occupy(GlCloth& cloth, Room room, const ClothParameters& parameters);
  // Targets of the pins of `model`: those that stay keep theirs, new ones start where they are.
  std::vector<uint32_t> CarryTargets(const GlCloth& cloth, const SceneModel& model);
  void WriteState(GlCloth& cloth, const ParticleState& state);
  void WriteTargets(const GlCloth& cloth, std::span<const uint32_t> words);
  // The own rest lengths before and at the end of the next step.
  void WriteLengths(const GlCloth& cloth, std::span<const uint32_t> starts);
  // A step begins with the lengths at which the last one ended; without targets it keeps them.
  void SetLengthTargets(GlCloth& cloth, std::span<const double> rest_lengths_m);
  // The colliders' motions from the start of the next step on, where they differ from the last.
  void WriteMotions(GlCloth& cloth, std::span<const RigidMotion> motions);
  // The step is over: the motions go on from its end, unless the cloth is faulted.
  void EndMotions(GlCloth& cloth);
  void WriteRecord(uint32_t slot);
  std::vector<float> ReadColumn(uint32_t begin, uint32_t count);
  // All positions, then all velocities, of whole cloths.
  std::vector<StateColumn> ColumnsOf(const ReadRequest& request);

  Parts parts_;
  ModelStore models_;
  MapStore maps_;
  GlClothTable cloths_;
};

Status GlBackend::ChooseKernels(const SceneModel& model, const ClothParameters& parameters,
                                bool has_own_lengths, Room& room) {
  DeviceTraits traits = parts_.traits;
  while (true) {
    const Result<VariantChoice> choice = ChooseVariant(model, parameters, traits, has_own_lengths);
    if (!choice.ok()) return choice.status();
    const Result<const StepKernels*> kernels = parts_.kernels->ForVariant(choice->variant);
    if (kernels.ok()) {
      room.kernels = kernels.value();
      room.part_count = choice->part_count;
      return Status::Ok();
    }
    if (choice->variant.strip_solve == StripSolve::kElimination) return kernels.status();
    traits.strip_solve = StripSolve::kElimination;
  }
}

Result<GlBackend::Room> GlBackend::MakeRoom(std::shared_ptr<const SceneModel> model,
                                            const ClothParameters& parameters,
                                            bool has_own_lengths) {
  DeviceArrays& arrays = *parts_.arrays;
  Room room;
  DRAPE_RETURN_IF_ERROR(ChooseKernels(*model, parameters, has_own_lengths, room));
  const KernelVariant& variant = room.kernels->variant;
  Result<WordRange> parameter_words =
      arrays.parameters.Allocate(ParameterWordCount(*model, parameters, has_own_lengths));
  if (!parameter_words.ok()) return parameter_words.status();
  room.parameter_words = std::move(parameter_words).value();
  Result<WordRange> scratch = arrays.scratch.Allocate(
      LayOutScratch(*model, parameters, variant.is_tiled() || variant.is_in_parts).size);
  if (!scratch.ok()) return scratch.status();
  room.scratch = std::move(scratch).value();
  DRAPE_RETURN_IF_ERROR(arrays.ReserveBatch(cloths_.count() + 1, MostDispatchesOfSweep(*model)));
  const bool has_air_forces = HasAirForces(*model, parameters);
  Result<std::shared_ptr<const DeviceModel>> on_device =
      models_.Acquire(std::move(model), has_air_forces);
  if (!on_device.ok()) return on_device.status();
  room.model = std::move(on_device).value();
  for (const Collider& collider : parameters.colliders) {
    const auto* solid = std::get_if<DistanceMapCollider>(&collider);
    if (solid == nullptr) continue;
    Result<std::shared_ptr<const DeviceMap>> map = maps_.Acquire(solid->map);
    if (!map.ok()) return map.status();
    room.maps.push_back(std::move(map).value());
  }
  return room;
}

void GlBackend::Occupy(GlCloth& cloth, Room room, const ClothParameters& parameters) {
  cloth.model = std::move(room.model);
  cloth.maps = std::move(room.maps);
  cloth.kernels = room.kernels;
  cloth.kernels_without_look = nullptr;
  cloth.looks = {};
  cloth.parameter_words = std::move(room.parameter_words);
  cloth.scratch = std::move(room.scratch);
  cloth.parameters = parameters;
  cloth.max_iterations = parameters.settings.max_iterations;
  cloth.part_count = room.part_count;
  cloth.costs = CountResidentLoops(
      *cloth.model->model, parameters, cloth.kernels->variant.local_size,
      cloth.kernels->variant.has_own_lengths, cloth.kernels->variant.strip_solve);
  // A function of the model and the settings alone, so that a restored cloth computes the same
  // bits.
  cloth.tolerance = SinglePrecisionTolerance(parameters.settings.tolerance, *cloth.model->model);
}

void GlBackend::WriteState(GlCloth& cloth, const ParticleState& state) {
  DRAPE_CHECK(state.positions_m.size() == cloth.particle_count() &&
                  state.velocities_m_per_s.size() == cloth.particle_count(),
              "a state must have one position and one velocity per particle");
  parts_.arrays->states.Write(cloth.state, 0, std::span<const float>(PackState(state)));
  cloth.fault = FaultReason::kNone;
}

void GlBackend::WriteTargets(const GlCloth& cloth, std::span<const uint32_t> words) {
  DRAPE_CHECK(words.size() == 3 * size_t{cloth.pin_count()}, "one target per pin");
  parts_.arrays->parameters.Write(cloth.parameter_words, 0, words);
}

void GlBackend::WriteLengths(const GlCloth& cloth, std::span<const uint32_t> starts) {
  const uint32_t offset = LengthsOffset(*cloth.model->model, cloth.parameters);
  parts_.arrays->parameters.Write(cloth.parameter_words, offset, starts);
  parts_.arrays->parameters.Write(
      cloth.parameter_words, offset + static_cast<uint32_t>(starts.size()), cloth.length_words);
}

void GlBackend::SetLengthTargets(GlCloth& cloth, std::span<const double> rest_lengths_m) {
  const bool has_targets = !rest_lengths_m.empty();
  if (!has_targets && !cloth.are_lengths_moving) return;
  DRAPE_CHECK(cloth.has_own_lengths(), "only a cloth with rest lengths of its own is driven");
  const std::vector<uint32_t> starts = cloth.length_words;
  if (has_targets) cloth.length_words = PackLengths(rest_lengths_m);
  DRAPE_CHECK(cloth.length_words.size() == starts.size(), "one rest length per constraint");
  WriteLengths(cloth, starts);
  cloth.are_lengths_moving = has_targets;
}

void GlBackend::WriteMotions(GlCloth& cloth, std::span<const RigidMotion> motions) {
  if (motions.empty()) return;
  const ClothParameters& parameters = cloth.parameters;
  DRAPE_CHECK(motions.size() == parameters.colliders.size(), "one motion per collider");
  std::vector<uint32_t> words = PackMotions(motions, parameters.settings.substep_s());
  if (words == cloth.motion_words) return;
  cloth.motion_words = std::move(words);
  parts_.arrays->parameters.Write(
      cloth.parameter_words, MotionsOffset(*cloth.model->model, parameters), cloth.motion_words);
}

void GlBackend::EndMotions(GlCloth& cloth) {
  std::vector<RigidMotion>& motions = cloth.parameters.collider_motions;
  if (cloth.fault == FaultReason::kNone) {
    const double step_s = cloth.parameters.settings.time_step_s;
    for (RigidMotion& motion : motions) motion = motion.After(step_s);
    return;
  }
  // Measured where its state is.
  std::vector<RigidMotion> stopped = motions;
  for (RigidMotion& motion : stopped) {
    motion.velocity_m_per_s.setZero();
    motion.angular_velocity_rad_per_s.setZero();
  }
  WriteMotions(cloth, stopped);
}

void GlBackend::WriteRecord(uint32_t slot) {
  GlCloth& cloth = cloths_.AtSlot(slot);
  cloth.motion_words.clear();
  WriteMotions(cloth, cloth.parameters.collider_motions);
  DeviceArrays& arrays = *parts_.arrays;
  arrays.parameters.Write(cloth.parameter_words, 3 * cloth.pin_count(),
                          PackColliders(cloth.parameters.colliders, cloth.maps));
  const shader::ClothRecord record = MakeClothRecord(cloth);
  arrays.cloths.Write(slot * sizeof(record), std::as_bytes(std::span(&record, 1)));
}

Result<ClothHandle> GlBackend::Create(std::shared_ptr<const SceneModel> model,
                                      const ClothParameters& parameters,
                                      const ParticleState& state) {
  parts_.context->MakeCurrent();
  DeviceArrays& arrays = *parts_.arrays;
  GlCloth cloth;
  Result<WordRange> state_words = arrays.states.Allocate(6 * uint64_t{model->particle_count()});
  if (!state_words.ok()) return state_words.status();
  cloth.state = std::move(state_words).value();
  Result<Room> room = MakeRoom(std::move(model), parameters);
  if (!room.ok()) return room.status();
  DRAPE_RETURN_IF_ERROR(
      arrays.cloths.Reserve((cloths_.slot_count() + 1) * sizeof(shader::ClothRecord)));
  // From here on nothing can fail.
  Occupy(cloth, std::move(room).value(), parameters);
  WriteState(cloth, state);
  WriteTargets(cloth, PackTargets(PinPositions(*cloth.model->model, state)));
  const ClothHandle handle = cloths_.Add(std::move(cloth));
  WriteRecord(handle.slot);
  return handle;
}

void GlBackend::Destroy(ClothHandle handle) {
  parts_.context->MakeCurrent();
  cloths_.Remove(handle);
}

std::vector<float> GlBackend::ReadColumn(uint32_t begin, uint32_t count) {
  std::vector<float> words(count);
  const StateColumn column{begin, count};
  parts_.reader->Begin(parts_.arrays->states.buffer(), {&column, 1}).Take({words});
  return words;
}

std::vector<uint32_t> GlBackend::CarryTargets(const GlCloth& cloth, const SceneModel& model) {
  const std::span<const uint32_t> old_pins = cloth.model->model->pins();
  const std::vector<uint32_t> old_targets =
      parts_.arrays->parameters.Read(cloth.parameter_words, 0, 3 * cloth.pin_count());
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
  parts_.context->MakeCurrent();
  GlCloth& cloth = cloths_.Find(handle);
  const std::shared_ptr<const SceneModel> model = update.model ? update.model : cloth.model->model;
  DRAPE_CHECK(model->particle_count() == cloth.particle_count(),
              "a new model must have the same particle count");
  if (update.model || update.parameters || update.rest_lengths_m || update.collider_motions) {
    std::vector<uint32_t> lengths = update.model ? std::vector<uint32_t>{} : cloth.length_words;
    if (update.rest_lengths_m) lengths = PackLengths(*update.rest_lengths_m);
    DRAPE_CHECK(lengths.empty() || lengths.size() == model->constraint_count(),
                "one rest length per constraint");
    ClothParameters parameters = update.parameters.value_or(cloth.parameters);
    if (update.collider_motions) parameters.collider_motions = *update.collider_motions;
    Result<Room> room = MakeRoom(model, parameters, !lengths.empty());
    if (!room.ok()) return room.status();
    // From here on nothing can fail.
    if (update.state) WriteState(cloth, *update.state);
    const std::vector<uint32_t> targets = CarryTargets(cloth, *model);
    Occupy(cloth, std::move(room).value(), parameters);
    WriteTargets(cloth, targets);
    cloth.length_words = std::move(lengths);
    cloth.are_lengths_moving = false;
    if (cloth.has_own_lengths()) WriteLengths(cloth, cloth.length_words);
    WriteRecord(handle.slot);
  } else if (update.state) {
    WriteState(cloth, *update.state);
  }
  if (update.pin_targets_m) WriteTargets(cloth, PackTargets(*update.pin_targets_m));
  return Status::Ok();
}

BatchReport GlBackend::StepAhead(std::span<const StepItem> items,
                                 const std::function<void()>& meanwhile) {
  parts_.context->MakeCurrent();
  for (const StepItem& item : items) {
    GlCloth& cloth = cloths_.Find(item.cloth);
    if (cloth.fault != FaultReason::kNone) continue;
    if (!item.pin_targets_m.empty()) WriteTargets(cloth, PackTargets(item.pin_targets_m));
    SetLengthTargets(cloth, item.rest_lengths_m);
    if (!item.collider_motions.empty()) {
      DRAPE_CHECK(HasMovingColliders(cloth.parameters),
                  "only a cloth with moving colliders has motions");
      cloth.parameters.collider_motions.assign(item.collider_motions.begin(),
                                               item.collider_motions.end());
    }
    WriteMotions(cloth, cloth.parameters.collider_motions);
    const uint32_t max_iterations = IterationsOf(item, cloth.parameters.settings);
    if (max_iterations != cloth.max_iterations) {
      cloth.max_iterations = max_iterations;
      WriteRecord(item.cloth.slot);
    }
  }
  BatchReport report = RunBatch(items, cloths_, *parts_.arrays, *parts_.kernels, parts_.measure,
                                parts_.device, parts_.runs_ahead ? meanwhile : nullptr);
  const std::string reset_reason = parts_.context->ResetReason();
  for (const StepItem& item : items) EndMotions(cloths_.Find(item.cloth));
  // Every state on the device is gone; only a new process can have a device again.
  DRAPE_CHECK(reset_reason.empty(), reset_reason);
  return report;
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
  parts_.context->MakeCurrent();
  RowPlan plan(request.particles);
  size_t words = 0;
  for (const ClothHandle handle : request.cloths) {
    words += plan.AddCloth(cloths_.Find(handle).particle_count());
  }
  StateTransfer transfer =
      parts_.reader->Begin(parts_.arrays->states.buffer(), ColumnsOf(request), plan.runs());
  return std::make_unique<GlRead>(*parts_.context, std::move(transfer), std::move(plan),
                                  request.positions ? words : 0, request.velocities ? words : 0);
}

std::shared_ptr<DeviceCopy> GlBackend::CopyOnDevice(const ReadRequest& request) {
  DRAPE_CHECK(request.particles.empty(), "copies are of whole cloths");
  parts_.context->MakeCurrent();
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
    buffer->CopyFrom(parts_.arrays->states.buffer(), column.begin * sizeof(float), target,
                     column_bytes);
    target += column_bytes;
  }
  return std::make_shared<DeviceCopy>(DeviceCopy{std::move(buffer).value(), gl::Fence::Insert()});
}

// Mesa's llvmpipe leaves all loops of an invocation after 65535 passes; the rest is slack for what
// the count does not see.
constexpr uint32_t kSoftwareLoopBudget = 60'000;
// About a second at 60 ns per pass; watchdogs of graphics drivers wait for two or more.
constexpr uint32_t kHardwareLoopBudget = 1u << 24;

Status CheckLimits(const gl::DeviceLimits& limits) {
  constexpr uint32_t kStorageBlocks = 8;
  constexpr int64_t kSharedMemoryBytes = 32 * 1024;
  if (limits.storage_blocks >= kStorageBlocks && limits.shared_memory_bytes >= kSharedMemoryBytes) {
    return Status::Ok();
  }
  return Status(StatusCode::kUnavailable, "NO_EGL_DEVICE",
                "the OpenGL driver offers " + std::to_string(limits.storage_blocks) +
                    " storage blocks and " + std::to_string(limits.shared_memory_bytes) +
                    " bytes of shared memory; 8 and 32768 are needed");
}

// Groups of lanes must fill subgroups.
StripSolve StripSolveOf(const gl::DeviceLimits& limits) {
  const bool has_lanes = limits.shuffle_size > 0 && limits.shuffle_size % DRAPE_STRIP_LANES == 0;
  return has_lanes ? StripSolve::kReduction : StripSolve::kElimination;
}

const char* NameOf(StripSolve strip_solve) {
  switch (strip_solve) {
    case StripSolve::kElimination:
      return "elimination";
    case StripSolve::kReduction:
      return "reduction";
    case StripSolve::kReductionWithBarriers:
      return "reduction_with_barriers";
  }
  return "";
}

}  // namespace

Result<std::unique_ptr<Backend>> CreateGlBackend(const GlBackendOptions& options) {
  GlBackend::Parts parts;
  Result<std::unique_ptr<gl::Context>> context = gl::Context::Create(
      {.accept_software = options.accept_software, .device_filter = options.device_filter});
  if (!context.ok()) return context.status();
  parts.context = std::move(context).value();
  if (options.on_context) options.on_context(parts.context->share_handle());
  const gl::DeviceLimits& limits = parts.context->limits();
  DRAPE_RETURN_IF_ERROR(CheckLimits(limits));
  const bool is_software = parts.context->is_software();
  parts.traits = {.is_software = is_software,
                  .renderer = parts.context->renderer(),
                  .local_size = options.local_size,
                  .refine_local_size = options.refine_local_size,
                  .loop_budget = options.loop_budget != 0 ? options.loop_budget
                                 : is_software            ? kSoftwareLoopBudget
                                                          : kHardwareLoopBudget,
                  .strip_solve = options.strip_solve.value_or(StripSolveOf(limits)),
                  .leaves_out_colliders = options.leave_out_colliders,
                  .finds_regular_strips = options.find_regular_strips};
  parts.runs_ahead = options.runs_ahead.value_or(!is_software);
  parts.device = {.limits = {limits.work_group_count_x, limits.work_group_count_y},
                  .has_timer_queries = !is_software,
                  .look_pause = options.look_pause.value_or(is_software ? kSoftwareLookPause : 0),
                  .on_left_out = options.on_left_out};
  const int64_t max_bytes = options.max_array_bytes > 0
                                ? std::min(options.max_array_bytes, limits.storage_block_bytes)
                                : limits.storage_block_bytes;

  Result<std::unique_ptr<DeviceArrays>> arrays = DeviceArrays::Create(max_bytes);
  if (!arrays.ok()) return arrays.status();
  parts.arrays = std::move(arrays).value();
  Result<KernelCache> kernels = KernelCache::Create(options.shader_dir);
  if (!kernels.ok()) return kernels.status();
  parts.kernels = std::make_unique<KernelCache>(std::move(kernels).value());
  const uint32_t local_size = GeneralLocalSize(parts.traits);
  const Result<const gl::Program*> pieces = parts.kernels->General("measure_pieces", local_size);
  if (!pieces.ok()) return pieces.status();
  const Result<const gl::Program*> total = parts.kernels->General("measure_total", local_size);
  if (!total.ok()) return total.status();
  parts.measure = {pieces.value(), total.value()};
  const Result<const gl::Program*> pack = parts.kernels->General("pack", local_size);
  if (!pack.ok()) return pack.status();
  Result<StateReader> reader = StateReader::Create(pack.value(), max_bytes, parts.device.limits);
  if (!reader.ok()) return reader.status();
  parts.reader = std::make_unique<StateReader>(std::move(reader).value());
  spdlog::info("gl_backend device=\"{}\" version=\"{}\" max_array_bytes={} strips={}",
               parts.context->renderer(), parts.context->version(), max_bytes,
               NameOf(parts.traits.strip_solve));
  return std::unique_ptr<Backend>(std::make_unique<GlBackend>(std::move(parts)));
}

}  // namespace drape
