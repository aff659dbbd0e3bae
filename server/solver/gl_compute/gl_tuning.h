// Settings of the gl backend that tests and measurements choose instead of the device's.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "server/core/status.h"
#include "server/solver/backend.h"
#include "server/solver/gl_compute/gl_backend.h"
#include "server/solver/gl_compute/strip_solve.h"

namespace drape {

// No result depends on any of these, except that reduction and elimination of strips round
// differently.
struct GlTuning {
  // Largest size of any one device array [bytes]; 0: the device's limit.
  int64_t max_array_bytes = 0;
  // Invocations per work group, a power of two; 0: what suits the device. Where strips are solved
  // from both ends, resident kernels and those of strips have as many as they have rows.
  uint32_t local_size = 0;
  // Invocations of the work group that refines a tiled cloth; 0: like local_size.
  uint32_t refine_local_size = 0;
  // Most passes through loops in one dispatch of a resident step; 0: what suits the device.
  uint32_t loop_budget = 0;
  // The way to solve strips; unset: from both ends on hardware, else by elimination. If the device
  // does not compile a kernel by another way than elimination, its cloths are solved by
  // elimination, with a warning in the log.
  std::optional<StripSolve> strip_solve = std::nullopt;
  // Whether kernels round roots and quotients correctly whatever the driver does; unset: on
  // hardware.
  std::optional<bool> correct_roots = std::nullopt;
  // Whether the driver's roots and quotients are made wrong by -1 to +2 ulp, as those of hardware.
  bool inject_root_errors = false;
  // Whether resident kernels share the record of their cloth; unset: on hardware. On a software
  // renderer registers are memory like any other. No bit depends on it.
  std::optional<bool> share_record = std::nullopt;
  // Whether a step leaves out the colliders that a cloth cannot meet in it.
  bool leave_out_colliders = true;
  // Called after each batch with the number of colliders that its steps left out.
  std::function<void(uint32_t)> on_left_out = {};
  // Whether regular strips (regular_strips.h) are solved without lists of particles and lengths.
  bool find_regular_strips = true;
  // Pairs that a cloth that touches itself has room for at first, per particle; 0: the usual
  // number.
  uint32_t first_pairs_per_particle = 0;
  // Whether the host works while the device steps (DeviceBackend::StepAhead); unset: on hardware. A
  // software renderer works on the calling thread.
  std::optional<bool> runs_ahead = std::nullopt;
};

// CreateGlBackend with this tuning.
Result<std::unique_ptr<Backend>> CreateTunedGlBackend(const GlBackendOptions& options,
                                                      const GlTuning& tuning);

}  // namespace drape
