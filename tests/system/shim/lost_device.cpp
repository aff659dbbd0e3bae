// Loaded into draped before its libraries: loses the device as a driver would, when the file that
// DRAPE_TEST_LOST_DEVICE names says so. "reset" once, "resets" as long as the file is there, or
// "hang": fences are never reached any more by this process.
#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

namespace {

// Whether the file says `word`, which is then done with.
bool IsTold(const std::string& word, bool stays = false) {
  const char* const path = std::getenv("DRAPE_TEST_LOST_DEVICE");
  std::ifstream file(path == nullptr ? "" : path);
  std::string told;
  file >> told;
  if (told != word) return false;
  if (!stays) std::filesystem::remove(path);
  return true;
}

GLenum ResetStatus() {
  const bool is_reset = IsTold("reset") || IsTold("resets", true);
  return is_reset ? GL_INNOCENT_CONTEXT_RESET : GL_NO_ERROR;
}

std::atomic<bool> hangs = false;

GLenum ClientWaitSync(GLsync sync, GLbitfield flags, GLuint64 timeout_ns) {
  if (IsTold("hang")) hangs = true;
  if (hangs) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return GL_TIMEOUT_EXPIRED;
  }
  static const auto real =
      reinterpret_cast<PFNGLCLIENTWAITSYNCPROC>(eglGetProcAddress("glClientWaitSync"));
  return real(sync, flags, timeout_ns);
}

[[gnu::constructor]] void TakeOver() {
  epoxy_glGetGraphicsResetStatus = ResetStatus;
  epoxy_glClientWaitSync = ClientWaitSync;
}

}  // namespace
