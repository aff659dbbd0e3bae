#include "server/gl/context.h"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <sstream>

#include "server/gl/debug_log.h"

namespace drape::gl {

namespace {

bool HasExtension(const char* extensions, std::string_view name) {
  if (extensions == nullptr) return false;
  std::istringstream words(extensions);
  for (std::string word; words >> word;) {
    if (word == name) return true;
  }
  return false;
}

Status NoDevice(const std::string& details) {
  return Status(StatusCode::kUnavailable, "NO_EGL_DEVICE",
                "no EGL device with OpenGL 4.5 compute" + details +
                    "; install the driver of the GPU, or for the software renderer the packages "
                    "libegl1, libegl-mesa0, libgl1-mesa-dri and libopengl0");
}

Status NotUsable(const std::string& message) {
  return Status(StatusCode::kUnavailable, "NO_EGL_DEVICE", message);
}

std::string Hex(EGLint error) {
  std::ostringstream text;
  text << "EGL error 0x" << std::hex << error;
  return text.str();
}

// The library that is missing, if one is: epoxy, which opens them, ends the process then.
// They stay open, since epoxy needs them.
std::string MissingLibrary() {
  const auto opens = [](const char* name) {
    return dlopen(name, RTLD_LAZY | RTLD_LOCAL) != nullptr;
  };
  if (!opens("libEGL.so.1")) return "libEGL.so.1";
  if (!opens("libOpenGL.so.0") && !opens("libGL.so.1")) return "libOpenGL.so.0";
  return "";
}

// The last that this thread made current.
thread_local Context* current = nullptr;

bool IsSoftwareRenderer(const std::string& renderer) {
  for (const char* name : {"llvmpipe", "softpipe", "swrast", "SWR", "Software"}) {
    if (renderer.find(name) != std::string::npos) return true;
  }
  return false;
}

std::string GlString(GLenum name) {
  const GLubyte* text = glGetString(name);
  return text == nullptr ? "" : reinterpret_cast<const char*>(text);
}

EGLContext CreateEglContext(EGLDisplay display, EGLContext share_context) {
  // Contexts of a share group must agree on robustness; one of the attempts does. Only news of a
  // reset is wanted: robust access would check the bounds of every access to memory, but there are
  // drivers that offer both or nothing. The last attempt has none, because EGL 1.4 drivers may not
  // offer it.
  const std::array<EGLint, 4> robust = {EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY,
                                        EGL_LOSE_CONTEXT_ON_RESET, EGL_CONTEXT_OPENGL_ROBUST_ACCESS,
                                        EGL_TRUE};
  for (const size_t robust_count : {2, 4, 0}) {
    std::vector<EGLint> attributes = {
        EGL_CONTEXT_MAJOR_VERSION,       4,
        EGL_CONTEXT_MINOR_VERSION,       5,
        EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT};
    attributes.insert(attributes.end(), robust.begin(), robust.begin() + robust_count);
    attributes.push_back(EGL_NONE);
    const EGLContext context =
        eglCreateContext(display, EGL_NO_CONFIG_KHR, share_context, attributes.data());
    if (context != EGL_NO_CONTEXT) return context;
  }
  return EGL_NO_CONTEXT;
}

int64_t GlInteger(GLenum name) {
  GLint64 value = 0;
  glGetInteger64v(name, &value);
  return value;
}

uint32_t GlIndexed(GLenum name, GLuint index) {
  GLint value = 0;
  glGetIntegeri_v(name, index, &value);
  return static_cast<uint32_t>(value);
}

// Drivers may list only GL_KHR_shader_subgroup and omit the extensions of the shading language.
uint32_t ShuffleSize() {
  if (!epoxy_has_gl_extension("GL_KHR_shader_subgroup")) return 0;
  const int64_t stages = GlInteger(GL_SUBGROUP_SUPPORTED_STAGES_KHR);
  const int64_t features = GlInteger(GL_SUBGROUP_SUPPORTED_FEATURES_KHR);
  if ((stages & GL_COMPUTE_SHADER_BIT) == 0) return 0;
  constexpr int64_t kNeeded =
      GL_SUBGROUP_FEATURE_BALLOT_BIT_KHR | GL_SUBGROUP_FEATURE_SHUFFLE_BIT_KHR;
  if ((features & kNeeded) != kNeeded) return 0;
  return static_cast<uint32_t>(GlInteger(GL_SUBGROUP_SIZE_KHR));
}

}  // namespace

std::vector<EglDevice> ListEglDevices() {
  if (!MissingLibrary().empty()) return {};
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const bool can_list = HasExtension(extensions, "EGL_EXT_device_base") ||
                        HasExtension(extensions, "EGL_EXT_device_enumeration");
  if (!can_list || !HasExtension(extensions, "EGL_EXT_platform_base")) return {};
  EGLint count = 0;
  if (!eglQueryDevicesEXT(0, nullptr, &count) || count <= 0) return {};
  std::vector<EGLDeviceEXT> handles(static_cast<size_t>(count));
  if (!eglQueryDevicesEXT(count, handles.data(), &count)) return {};
  std::vector<EglDevice> devices;
  for (EGLint index = 0; index < count; ++index) {
    EglDevice device{
        .handle = handles[static_cast<size_t>(index)], .index = index, .extensions = {}};
    const char* device_extensions = eglQueryDeviceStringEXT(device.handle, EGL_EXTENSIONS);
    device.extensions = device_extensions == nullptr ? "" : device_extensions;
    device.is_software = HasExtension(device_extensions, "EGL_MESA_device_software");
    devices.push_back(std::move(device));
  }
  std::stable_partition(devices.begin(), devices.end(),
                        [](const EglDevice& device) { return !device.is_software; });
  return devices;
}

std::optional<std::string> FindHardwareGl() {
  const Result<std::unique_ptr<Context>> context = Context::Create({.accept_software = false});
  if (!context.ok()) return std::nullopt;
  return context.value()->renderer();
}

Result<std::unique_ptr<Context>> Context::Create(const ContextOptions& options) {
  if (options.share_with) {
    return CreateOnDisplay(options.share_with->display, options.share_with->context,
                           options.accept_software);
  }
  std::string details;
  if (const std::string missing = MissingLibrary(); !missing.empty()) {
    details = "; " + missing + " is not installed";
  }
  for (const EglDevice& device : ListEglDevices()) {
    const std::string place = "; device " + std::to_string(device.index) + ": ";
    if (options.device_filter && !options.device_filter(device)) {
      details += place + "not allowed";
      continue;
    }
    if (device.is_software && !options.accept_software) {
      details += place + "software, not accepted";
      continue;
    }
    Result<std::unique_ptr<Context>> context = CreateOn(device, options.accept_software);
    if (context.ok()) return context;
    details += place + context.status().message();
  }
  return NoDevice(details);
}

Result<std::unique_ptr<Context>> Context::CreateOn(const EglDevice& device, bool accept_software) {
  const EGLDisplay display =
      eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device.handle, nullptr);
  if (display == EGL_NO_DISPLAY) return NotUsable("no display, " + Hex(eglGetError()));
  return CreateOnDisplay(display, EGL_NO_CONTEXT, accept_software);
}

Result<std::unique_ptr<Context>> Context::CreateOnDisplay(void* display, void* share_context,
                                                          bool accept_software) {
  EGLint major = 0;
  EGLint minor = 0;
  if (!eglInitialize(display, &major, &minor)) {
    return NotUsable("not initialised, " + Hex(eglGetError()));
  }
  const char* extensions = eglQueryString(display, EGL_EXTENSIONS);
  if (!HasExtension(extensions, "EGL_KHR_surfaceless_context") ||
      !(HasExtension(extensions, "EGL_KHR_no_config_context") ||
        HasExtension(extensions, "EGL_MESA_configless_context"))) {
    return NotUsable("no contexts without surface and config");
  }
  if (!eglBindAPI(EGL_OPENGL_API)) return NotUsable("no OpenGL, " + Hex(eglGetError()));
  const EGLContext egl_context = CreateEglContext(display, share_context);
  if (egl_context == EGL_NO_CONTEXT) {
    return NotUsable((share_context == EGL_NO_CONTEXT ? "no OpenGL 4.5, " : "not shared, ") +
                     Hex(eglGetError()));
  }
  // Not make_unique: the constructor is private.
  std::unique_ptr<Context> context(new Context(display, egl_context));
  if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, egl_context)) {
    return NotUsable("context not usable, " + Hex(eglGetError()));
  }
  current = context.get();
  DRAPE_RETURN_IF_ERROR(context->Describe(accept_software));
  EnableDebugLog();
  return context;
}

// Needs the context to be current.
Status Context::Describe(bool accept_software) {
  renderer_ = GlString(GL_RENDERER);
  version_ = GlString(GL_VERSION);
  is_software_ = IsSoftwareRenderer(renderer_);
  if (is_software_ && !accept_software) {
    return Status(StatusCode::kUnavailable, "NO_EGL_DEVICE",
                  "software renderer " + renderer_ + ", not accepted");
  }
  limits_ = {
      .storage_block_bytes = GlInteger(GL_MAX_SHADER_STORAGE_BLOCK_SIZE),
      .shared_memory_bytes = GlInteger(GL_MAX_COMPUTE_SHARED_MEMORY_SIZE),
      .work_group_invocations =
          static_cast<uint32_t>(GlInteger(GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS)),
      .work_group_count_x = GlIndexed(GL_MAX_COMPUTE_WORK_GROUP_COUNT, 0),
      .work_group_count_y = GlIndexed(GL_MAX_COMPUTE_WORK_GROUP_COUNT, 1),
      .storage_blocks = static_cast<uint32_t>(GlInteger(GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS)),
      .shuffle_size = ShuffleSize()};
  return Status::Ok();
}

Context::~Context() {
  // The display stays initialised: other contexts of the process may share it.
  staging_.Forget();
  if (eglGetCurrentContext() == context_) {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  }
  if (current == this) current = nullptr;
  eglDestroyContext(display_, context_);
}

void Context::MakeCurrent() {
  current = this;
  if (eglGetCurrentContext() == context_) return;
  eglBindAPI(EGL_OPENGL_API);
  DRAPE_CHECK(eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_),
              "an OpenGL context belongs to the thread that made it");
}

Context& Context::Current() {
  DRAPE_CHECK(current != nullptr && eglGetCurrentContext() == current->context_,
              "a context must be current");
  return *current;
}

std::string Context::ResetReason() const {
  switch (glGetGraphicsResetStatus()) {
    case GL_NO_ERROR:
      return "";
    case GL_GUILTY_CONTEXT_RESET:
      return "the device was reset because of this program";
    case GL_INNOCENT_CONTEXT_RESET:
      return "the device was reset because of another program";
    default:
      return "the device was reset";
  }
}

}  // namespace drape::gl
