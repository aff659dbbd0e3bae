#include "server/solver/gl_compute/gl_device.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "server/solver/gl_compute/local_sizes.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

// Mesa's llvmpipe leaves all loops of an invocation after 65535 passes; the rest is slack for
// passes that are not counted.
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

Status GlDevice::CompileGeneralKernels(const std::string& shader_dir, int64_t max_bytes) {
  Result<KernelCache> cache = KernelCache::Create(shader_dir);
  if (!cache.ok()) return cache.status();
  kernels = std::make_unique<KernelCache>(std::move(cache).value());
  const uint32_t local_size = GeneralLocalSize(traits);
  const Result<const gl::Program*> start = kernels->General("measure_start", local_size);
  if (!start.ok()) return start.status();
  const Result<const gl::Program*> pieces = kernels->General("measure_pieces", local_size);
  if (!pieces.ok()) return pieces.status();
  const Result<const gl::Program*> total = kernels->General("measure_total", local_size);
  if (!total.ok()) return total.status();
  const Result<const gl::Program*> strains = kernels->General("measure_strains", kStrainsLocalSize);
  if (!strains.ok()) return strains.status();
  measure = {start.value(), pieces.value(), total.value(), strains.value()};
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
  device.traits = {.is_software = is_software,
                   .renderer = device.context->renderer(),
                   .local_size = tuning.local_size,
                   .refine_local_size = tuning.refine_local_size,
                   .loop_budget = tuning.loop_budget != 0 ? tuning.loop_budget
                                  : is_software           ? kSoftwareLoopBudget
                                                          : kHardwareLoopBudget,
                   .strip_solve = tuning.strip_solve.value_or(StripSolveOf(limits)),
                   .leaves_out_colliders = tuning.leave_out_colliders,
                   .finds_regular_strips = tuning.find_regular_strips};
  device.runs_ahead = tuning.runs_ahead.value_or(!is_software);
  device.batch = {.limits = {limits.work_group_count_x, limits.work_group_count_y},
                  .has_timer_queries = !is_software,
                  .on_left_out = tuning.on_left_out};
  const int64_t max_bytes = tuning.max_array_bytes > 0
                                ? std::min(tuning.max_array_bytes, limits.storage_block_bytes)
                                : limits.storage_block_bytes;

  Result<std::unique_ptr<DeviceArrays>> arrays = DeviceArrays::Create(max_bytes);
  if (!arrays.ok()) return arrays.status();
  device.arrays = std::move(arrays).value();
  DRAPE_RETURN_IF_ERROR(device.CompileGeneralKernels(options.shader_dir, max_bytes));
  spdlog::info("gl_backend device=\"{}\" version=\"{}\" max_array_bytes={} strips={}",
               device.context->renderer(), device.context->version(), max_bytes,
               NameOf(device.traits.strip_solve));
  return device;
}

}  // namespace drape
