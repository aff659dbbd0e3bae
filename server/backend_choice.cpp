#include "server/backend_choice.h"

#include "server/gl/device_choice.h"
#include "server/render/gl_draw/gl_renderer.h"
#include "server/solver/cpu/cpu_backend.h"
#include "server/solver/cpu_reference/reference_backend.h"
#include "server/solver/gl_compute/gl_backend.h"

namespace drape {

namespace {

bool HasHardwareGl(const GlBackendOptions& options) {
  return gl::Context::Create({.accept_software = false, .device_filter = options.device_filter})
      .ok();
}

}  // namespace

Result<std::unique_ptr<Backend>> MakeBackend(const Config& config,
                                             std::optional<gl::ShareHandle>& context) {
  const bool wants_gl = config.backend == BackendChoice::kGl;
  GlBackendOptions options;
  if (wants_gl || config.backend == BackendChoice::kAuto) {
    DRAPE_ASSIGN_OR_RETURN(options.device_filter, gl::FilterFor(config.device));
  }
  if (wants_gl || (config.backend == BackendChoice::kAuto && HasHardwareGl(options))) {
    options.accept_software = wants_gl;
    options.shader_dir = config.shader_dir;
    options.on_context = [&context](const gl::ShareHandle& handle) { context = handle; };
    return CreateGlBackend(options);
  }
  if (config.backend == BackendChoice::kReference) return CreateReferenceBackend();
  return CreateCpuBackend({.thread_count = config.threads});
}

Result<std::unique_ptr<render::Renderer>> MakeRenderer(
    const Config& config, const std::optional<gl::ShareHandle>& context) {
  render::GlRendererOptions options;
  options.share_with = context;
  options.shader_dir = config.shader_dir;
  return render::CreateGlRenderer(options);
}

}  // namespace drape
