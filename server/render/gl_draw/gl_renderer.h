// Draws pictures with OpenGL 4.5. Vertex shaders fetch the particles from device memory, where the
// solver left them (Bender et al. 2009, section 4.3).
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "server/core/status.h"
#include "server/gl/context.h"
#include "server/render/renderer.h"

namespace drape::render {

struct GlRendererOptions {
  // Context of the `gl` backend, which must outlive the renderer: its copies on the device can then
  // be drawn. If the driver refuses to share, the renderer makes its own context and accepts states
  // of the host only.
  std::optional<gl::ShareHandle> share_with = std::nullopt;
  // Whether a software renderer (Mesa llvmpipe) is accepted.
  bool accept_software = true;
  // Directory whose files replace the embedded shaders, for developers; empty: none.
  std::string shader_dir = {};
};

// Owns an OpenGL context on the calling thread. UNAVAILABLE (NO_EGL_DEVICE), INTERNAL
// (SHADER_COMPILE_FAILED), NOT_FOUND (SHADER_DIR_NOT_FOUND, SHADER_DIR_UNUSED), RESOURCE_EXHAUSTED
// (DEVICE_MEMORY).
Result<std::unique_ptr<Renderer>> CreateGlRenderer(const GlRendererOptions& options);

}  // namespace drape::render
