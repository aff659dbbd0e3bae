// An OpenGL 4.5 compute context without a window: EGL device platform, surfaceless.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/core/status.h"
#include "server/gl/staging.h"

namespace drape::gl {

// One EGL device as the driver lists it.
struct EglDevice {
  void* handle = nullptr;  // EGLDeviceEXT
  int index = 0;           // in the driver's list
  bool is_software =
      false;  // EGL_MESA_device_software; a renderer may still turn out to be software
  std::string extensions;
};

// Limits for shaders; in bytes unless stated otherwise.
struct DeviceLimits {
  int64_t storage_block_bytes = 0;  // GL_MAX_SHADER_STORAGE_BLOCK_SIZE
  int64_t shared_memory_bytes = 0;  // GL_MAX_COMPUTE_SHARED_MEMORY_SIZE
  uint32_t work_group_invocations = 0;
  uint32_t work_group_count_x = 0;
  uint32_t work_group_count_y = 0;
  uint32_t storage_blocks = 0;  // per compute shader
  // Size of the subgroups in which compute shaders can exchange values by shuffles and ballots
  // (GL_KHR_shader_subgroup); 0: these are not supported.
  uint32_t shuffle_size = 0;
};

// Identifies a context for other contexts that share its objects (buffers, textures, fences). Valid
// while that context exists; any thread may hold it.
struct ShareHandle {
  void* display = nullptr;  // EGLDisplay
  void* context = nullptr;  // EGLContext
};

struct ContextOptions {
  bool accept_software = true;
  // Devices for which this is false are skipped; empty accepts all.
  std::function<bool(const EglDevice&)> device_filter = {};
  // If set: the same device and share group; the filter is not used.
  std::optional<ShareHandle> share_with = std::nullopt;
};

// All EGL devices, hardware first; empty if EGL cannot enumerate devices.
std::vector<EglDevice> ListEglDevices();

// The renderer string of the first device with a hardware OpenGL 4.5 compute driver, if any.
// Creates a temporary context on the calling thread.
std::optional<std::string> FindHardwareGl();

// Owns one context. Every call and the destructor must be on the thread that created it.
class Context {
 public:
  // On the first device that works, hardware before software. UNAVAILABLE (NO_EGL_DEVICE) says what
  // to install and what each device lacked, or why the context cannot be shared.
  static Result<std::unique_ptr<Context>> Create(const ContextOptions& options);
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  // Cheap if it is current already.
  void MakeCurrent();
  // Of the calling thread; one must be.
  static Context& Current();

  ShareHandle share_handle() const { return {.display = display_, .context = context_}; }

  bool is_software() const { return is_software_; }
  const std::string& renderer() const { return renderer_; }
  const std::string& version() const { return version_; }
  const DeviceLimits& limits() const { return limits_; }
  Staging& staging() { return staging_; }

  // Empty, or why the device has lost all its memory (GL_KHR_robustness).
  std::string ResetReason() const;

 private:
  Context(void* display, void* context) : display_(display), context_(context) {}
  Status Describe(bool accept_software);
  static Result<std::unique_ptr<Context>> CreateOn(const EglDevice& device, bool accept_software);
  // `share_context`: an EGLContext of the display, or null.
  static Result<std::unique_ptr<Context>> CreateOnDisplay(void* display, void* share_context,
                                                          bool accept_software);

  void* display_;
  void* context_;
  bool is_software_ = false;
  std::string renderer_;
  std::string version_;
  DeviceLimits limits_;
  Staging staging_;
};

}  // namespace drape::gl
