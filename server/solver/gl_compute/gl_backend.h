// The OpenGL 4.5 compute backend, "gl": float32, all cloths of a batch in few dispatches.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/core/status.h"
#include "server/gl/context.h"
#include "server/solver/backend.h"
#include "server/solver/gl_compute/strip_solve.h"

namespace drape {

struct GlBackendOptions {
  // Whether a software renderer (Mesa llvmpipe) will do where there is no hardware.
  bool accept_software = true;
  // Directory whose files replace the embedded shaders, for developers; empty: none.
  std::string shader_dir = {};
  // Devices for which this is false are passed over; empty accepts all.
  std::function<bool(const gl::EglDevice&)> device_filter = {};
  // Called on the device thread once the context is there, which lives as long as the backend.
  std::function<void(const gl::ShareHandle&)> on_context = {};
  // Largest size of any one device array [bytes]; 0: what the device allows.
  int64_t max_array_bytes = 0;
  // Invocations per work group, a power of two; 0: what suits the device. Results do not depend on
  // it.
  uint32_t local_size = 0;
  // Of the one work group that refines a tiled cloth; 0: like local_size.
  uint32_t refine_local_size = 0;
  // Most passes through loops that one dispatch of a resident step may make; 0: what suits the
  // device. Results do not depend on it.
  uint32_t loop_budget = 0;
  // How strips are solved where they are short enough; unset: by reduction where the device has
  // subgroups of enough invocations, else by elimination. Where the device does not compile a
  // kernel by reduction its cloths are solved by elimination, with a warning in the log.
  std::optional<StripSolve> strip_solve = std::nullopt;
  // Whether a step leaves out the colliders that a cloth cannot meet in it. Results do not depend
  // on it.
  bool leave_out_colliders = true;
  // Steps of a pause after which a cloth whose colliders were all within reach looks again
  // (collider_looks.h); 0: it looks in every step; unset: 0 on hardware, half a second at 60 Hz on
  // software. Results do not depend on it.
  std::optional<uint32_t> look_pause = std::nullopt;
  // Whether strips that are all regular (regular_strips.h), as those of a grid, are read as such,
  // without lists of their particles and rest lengths. Results do not depend on it.
  bool find_regular_strips = true;
  // Called after each batch with how many colliders its steps have left out, together; for tests.
  std::function<void(uint32_t)> on_left_out = {};
  // Whether the host goes on while the device works (DeviceBackend::StepAhead); unset: on hardware.
  // A software renderer works on the calling thread.
  std::optional<bool> runs_ahead = std::nullopt;
};

// Owns an OpenGL context on the calling thread, which becomes the device thread of the backend.
// UNAVAILABLE (NO_EGL_DEVICE), INTERNAL (SHADER_COMPILE_FAILED), NOT_FOUND (SHADER_DIR_NOT_FOUND,
// SHADER_DIR_UNUSED), RESOURCE_EXHAUSTED (DEVICE_MEMORY).
Result<std::unique_ptr<Backend>> CreateGlBackend(const GlBackendOptions& options);

}  // namespace drape
