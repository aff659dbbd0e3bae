#include "server/gl/sync.h"

#include <chrono>
#include <string>

#include "server/core/device_loss.h"

namespace drape::gl {

void WaitForDevice() {
  Fence::Insert().Wait();
}

Fence Fence::Insert() {
  Fence fence;
  fence.sync_ = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
  if (fence.sync_ == nullptr) LoseDevice("it takes no fence");
  glFlush();
  return fence;
}

Fence::~Fence() {
  if (sync_ != nullptr) glDeleteSync(sync_);
}

void Fence::WaitOnDevice() const {
  if (sync_ != nullptr) glWaitSync(sync_, 0, GL_TIMEOUT_IGNORED);
}

void Fence::Wait() const {
  if (sync_ == nullptr) return;
  constexpr GLuint64 kOneSecond_ns = 1'000'000'000;
  GLenum outcome = GL_TIMEOUT_EXPIRED;
  // Counted, not taken from a clock: the process may be stopped meanwhile.
  for (std::chrono::seconds waited{0}; outcome == GL_TIMEOUT_EXPIRED; ++waited) {
    const std::chrono::seconds patience = DevicePatience();
    if (patience.count() > 0 && waited >= patience) {
      LoseDevice("it has not answered for " + std::to_string(patience.count()) + " s");
    }
    outcome = glClientWaitSync(sync_, GL_SYNC_FLUSH_COMMANDS_BIT, kOneSecond_ns);
  }
  if (outcome == GL_WAIT_FAILED) LoseDevice("it does not wait for a fence");
}

int64_t TimerQuery::ElapsedUs() const {
  GLuint64 elapsed_ns = 0;
  glGetQueryObjectui64v(name_, GL_QUERY_RESULT, &elapsed_ns);
  return static_cast<int64_t>(elapsed_ns / 1000);
}

}  // namespace drape::gl
