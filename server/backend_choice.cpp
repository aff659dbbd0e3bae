#include "server/backend_choice.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "server/gl/device_choice.h"
#include "server/render/gl_draw/gl_renderer.h"
#include "server/solver/backend_pair.h"
#include "server/solver/cpu/cpu_backend.h"
#include "server/solver/cpu_reference/reference_backend.h"
#include "server/solver/gl_compute/gl_backend.h"

namespace drape {

namespace {

bool HasHardwareGl(const GlBackendOptions& options) {
  return gl::Context::Create({.accept_software = false, .device_filter = options.device_filter})
      .ok();
}

// A folder below the user's cache folder (XDG Base Directory Specification 0.8); empty if there is
// none.
std::string UserCache(const std::string& folder) {
  const auto below = [](const char* variable) {
    const char* path = std::getenv(variable);
    return path != nullptr && *path == '/' ? std::string(path) : std::string();
  };
  const std::string cache = below("XDG_CACHE_HOME"), home = below("HOME");
  if (!cache.empty()) return cache + "/" + folder;
  return home.empty() ? std::string() : home + "/.cache/" + folder;
}

}  // namespace

int PrintDevices() {
  const std::vector<gl::DeviceNames> devices = gl::ListDevices();
  for (const gl::DeviceNames& device : devices) std::printf("%s\n", gl::ToText(device).c_str());
  if (devices.empty()) std::fprintf(stderr, "draped: EGL lists no device\n");
  return devices.empty() ? 1 : 0;
}

Status AwaitGpu(const Config& config) {
  GlBackendOptions options;
  DRAPE_ASSIGN_OR_RETURN(options.device_filter, gl::FilterFor(config.device));
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!HasHardwareGl(options)) {
    if (std::chrono::steady_clock::now() > end) {
      return {StatusCode::kUnavailable, "NO_EGL_DEVICE", "the GPU that was lost has not come back"};
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
  return Status::Ok();
}

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
    options.program_cache_dir = config.program_cache_dir;
    options.hardware_program_cache_dir = UserCache("drape/programs");
    options.on_context = [&context](const gl::ShareHandle& handle) { context = handle; };
    DRAPE_ASSIGN_OR_RETURN(auto gl, CreateGlBackend(options));
    return PairBackends(std::move(gl), CreateCpuBackend({.thread_count = config.threads}));
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
