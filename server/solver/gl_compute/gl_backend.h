// The OpenGL 4.5 compute backend, "gl": float32, all cloths of a batch in few dispatches.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "server/core/status.h"
#include "server/gl/context.h"
#include "server/solver/backend.h"

namespace drape {

struct GlBackendOptions {
  // Whether a software renderer (Mesa llvmpipe) is accepted if there is no hardware.
  bool accept_software = true;
  // Directory whose files replace the embedded shaders, for developers; empty: none.
  std::string shader_dir = {};
  // Folder of compiled kernels (gl/program_store.h); empty: none.
  std::string program_cache_dir = {};
  // The same on hardware, where the other is empty. Mesa's renderer has a cache of its own.
  std::string hardware_program_cache_dir = {};
  // Devices for which this is false are skipped; empty accepts all.
  std::function<bool(const gl::EglDevice&)> device_filter = {};
  // Called on the device thread once the context exists, which lives as long as the backend.
  std::function<void(const gl::ShareHandle&)> on_context = {};
};

// Owns an OpenGL context on the calling thread, which becomes the device thread of the backend.
// UNAVAILABLE (NO_EGL_DEVICE), INTERNAL (SHADER_COMPILE_FAILED), NOT_FOUND (SHADER_DIR_NOT_FOUND,
// SHADER_DIR_UNUSED), RESOURCE_EXHAUSTED (DEVICE_MEMORY).
Result<std::unique_ptr<Backend>> CreateGlBackend(const GlBackendOptions& options);

}  // namespace drape
