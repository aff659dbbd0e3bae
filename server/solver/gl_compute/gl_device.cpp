#include "server/solver/gl_compute/gl_device.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "server/solver/gl_compute/local_sizes.h"
#include "server/solver/gl_compute/self_contact_words.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

// Mesa's llvmpipe leaves all loops of an invocation after 65535 passes; the rest is slack for
// passes that are not counted.
constexpr uint32_t kSoftwareLoopBudget = 60'000;
// About a second at 60 ns per pass; watchdogs of graphics drivers wait for two or more.
constexpr uint32_t kHardwareLoopBudget = 1u << 24;

// Records are shared where this much is left beside the least that OpenGL guarantees [bytes].
constexpr int64_t kRoomForRecords = 48 * 1024;

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

// A software renderer computes the invocations of a group in turn: nothing is gained by several.
StripSolve StripSolveOf(bool is_software, uint32_t shuffle_size) {
  if (is_software) return StripSolve::kElimination;
  const bool has_lanes = shuffle_size > 0 && shuffle_size % DRAPE_STRIP_LANES == 0;
  return has_lanes ? StripSolve::kReduction : StripSolve::kFromBothEnds;
}

// Hardware rounds roots and divisions by 1 to 3 ulp, software renderers correctly
// (lib/roots.glsl).
std::string RootDefines(const GlTuning& tuning, bool is_software) {
  std::string defines;
  if (tuning.correct_roots.value_or(!is_software)) defines += "#define CORRECTS_ROOTS\n";
  if (tuning.inject_root_errors) defines += "#define INJECTS_ROOT_ERRORS\n";
  return defines;
}

const char* NameOf(StripSolve strip_solve) {
  switch (strip_solve) {
    case StripSolve::kElimination:
      return "elimination";
    case StripSolve::kFromBothEnds:
      return "from_both_ends";
    case StripSolve::kReduction:
      return "reduction";
    case StripSolve::kReductionWithBarriers:
      return "reduction_with_barriers";
  }
  return "";
}

}  // namespace

Status GlDevice::CompileGeneralKernels(int64_t max_bytes) {
  const uint32_t local_size = GeneralLocalSize(traits);
  const Result<const gl::Program*> start = kernels->General("measure_start", local_size);
  if (!start.ok()) return start.status();
  const Result<const gl::Program*> pieces = kernels->General("measure_pieces", local_size);
  if (!pieces.ok()) return pieces.status();
  const Result<const gl::Program*> total = kernels->General("measure_total", local_size);
  if (!total.ok()) return total.status();
  const Result<const gl::Program*> strains = kernels->General("measure_strains", kStrainsLocalSize);
  if (!strains.ok()) return strains.status();
  const Result<const gl::Program*> begin = kernels->General("impulses_begin", local_size);
  if (!begin.ok()) return begin.status();
  const Result<const gl::Program*> impulses = kernels->General("impulses_total", local_size);
  if (!impulses.ok()) return impulses.status();
  measure = {start.value(),   pieces.value(), total.value(),
             strains.value(), begin.value(),  impulses.value()};
  const Result<const gl::Program*> pack = kernels->General("pack", local_size);
  if (!pack.ok()) return pack.status();
  Result<StateReader> state_reader = StateReader::Create(pack.value(), max_bytes, batch.limits);
  if (!state_reader.ok()) return state_reader.status();
  reader = std::make_unique<StateReader>(std::move(state_reader).value());
  return Status::Ok();
}

Result<GlDevice> GlDevice::Open(const GlBackendOptions& options, const GlTuning& tuning) {
  GlDevice device;
  Result<std::unique_ptr<gl::Context>> context = gl::Context::Create(
      {.accept_software = options.accept_software, .device_filter = options.device_filter});
  if (!context.ok()) return context.status();
  device.context = std::move(context).value();
  if (options.on_context) options.on_context(device.context->share_handle());
  const gl::DeviceLimits& limits = device.context->limits();
  DRAPE_RETURN_IF_ERROR(CheckLimits(limits));
  const bool is_software = device.context->is_software();
  device.traits = {
      .is_software = is_software,
      .renderer = device.context->renderer(),
      .local_size = tuning.local_size,
      .refine_local_size = tuning.refine_local_size,
      .loop_budget = tuning.loop_budget != 0 ? tuning.loop_budget
                     : is_software           ? kSoftwareLoopBudget
                                             : kHardwareLoopBudget,
      .strip_solve = tuning.strip_solve.value_or(StripSolveOf(is_software, limits.shuffle_size)),
      .shares_record = tuning.share_record.value_or(!is_software &&
                                                    limits.shared_memory_bytes >= kRoomForRecords),
      .leaves_out_colliders = tuning.leave_out_colliders,
      .finds_regular_strips = tuning.find_regular_strips};
  device.runs_ahead = tuning.runs_ahead.value_or(!is_software);
  device.first_pairs_per_particle = tuning.first_pairs_per_particle != 0
                                        ? tuning.first_pairs_per_particle
                                        : kFirstPairsPerParticle;
  device.batch = {.limits = {limits.work_group_count_x, limits.work_group_count_y},
                  .has_timer_queries = !is_software,
                  .on_left_out = tuning.on_left_out};
  const int64_t max_bytes = tuning.max_array_bytes > 0
                                ? std::min(tuning.max_array_bytes, limits.storage_block_bytes)
                                : limits.storage_block_bytes;

  Result<std::unique_ptr<DeviceArrays>> arrays = DeviceArrays::Create(max_bytes);
  if (!arrays.ok()) return arrays.status();
  device.arrays = std::move(arrays).value();
  const std::string& folder = options.program_cache_dir.empty() && !is_software
                                  ? options.hardware_program_cache_dir
                                  : options.program_cache_dir;
  DRAPE_ASSIGN_OR_RETURN(device.kernels,
                         KernelCache::Create(options.shader_dir, RootDefines(tuning, is_software),
                                             gl::ProgramStore::Open(folder)));
  DRAPE_RETURN_IF_ERROR(device.CompileGeneralKernels(max_bytes));
  spdlog::info("gl_backend device=\"{}\" version=\"{}\" max_array_bytes={} strips={}",
               device.context->renderer(), device.context->version(), max_bytes,
               NameOf(device.traits.strip_solve));
  return device;
}

}  // namespace drape
