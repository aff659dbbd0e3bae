// An OpenGL 4.5 compute context without a window: EGL device platform, surfaceless.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/core/status.h"

namespace drape::gl {

// One EGL device as the driver lists it.
struct EglDevice {
  void* handle = nullptr;  // EGLDeviceEXT
  int index = 0;           // in the driver's list
  bool is_software =
      false;  // EGL_MESA_device_software; a renderer may still turn out to be software
  std::string extensions;
};

// What a shader may use; bytes unless said otherwise.
struct DeviceLimits {
  int64_t storage_block_bytes = 0;  // GL_MAX_SHADER_STORAGE_BLOCK_SIZE
  int64_t shared_memory_bytes = 0;  // GL_MAX_COMPUTE_SHARED_MEMORY_SIZE
  uint32_t work_group_invocations = 0;
  uint32_t work_group_count_x = 0;
  uint32_t work_group_count_y = 0;
  uint32_t storage_blocks = 0;  // per compute shader
  // Invocations of a subgroup in which compute shaders can hand each other values by shuffles
  // (GL_KHR_shader_subgroup); 0: they cannot.
  uint32_t shuffle_size = 0;
};

// Names a context to those that want to share its objects (buffers, textures, fences). Valid while
// that context lives; any thread may hold it.
struct ShareHandle {
  void* display = nullptr;  // EGLDisplay
  void* context = nullptr;  // EGLContext
};

struct ContextOptions {
  bool accept_software = true;
  // Devices for which this is false are passed over; empty accepts all.
  std::function<bool(const EglDevice&)> device_filter = {};
  // Set: on the same device, in the same share group; the filter is not asked then.
  std::optional<ShareHandle> share_with = std::nullopt;
};

// All EGL devices, hardware first; empty where there is no EGL with device enumeration.
std::vector<EglDevice> ListEglDevices();

// The renderer string of the first device with a hardware OpenGL 4.5 compute driver, if any. Makes
// a context on the calling thread for a moment.
std::optional<std::string> FindHardwareGl();

// Owns one context. It belongs to the thread that made it: every call and the destructor on that
// thread.
class Context {
 public:
  // The first device that works, hardware before software. UNAVAILABLE (NO_EGL_DEVICE) with what to
  // install and what each device lacked, or why the context cannot be shared.
  static Result<std::unique_ptr<Context>> Create(const ContextOptions& options);
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  // Cheap when it is current already.
  void MakeCurrent();

  ShareHandle share_handle() const { return {.display = display_, .context = context_}; }

  bool is_software() const { return is_software_; }
  const std::string& renderer() const { return renderer_; }
  const std::string& version() const { return version_; }
  const DeviceLimits& limits() const { return limits_; }

  // "" or why the device has lost everything in it (GL_KHR_robustness).
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
};

}  // namespace drape::gl
