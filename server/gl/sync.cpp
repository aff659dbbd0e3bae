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
  const auto begin = std::chrono::steady_clock::now();
  GLenum outcome = GL_TIMEOUT_EXPIRED;
  while (outcome == GL_TIMEOUT_EXPIRED) {
    outcome = glClientWaitSync(sync_, GL_SYNC_FLUSH_COMMANDS_BIT, kOneSecond_ns);
    const std::chrono::seconds patience = DevicePatience();
    if (outcome == GL_TIMEOUT_EXPIRED && patience.count() > 0 &&
        std::chrono::steady_clock::now() - begin > patience) {
      LoseDevice("it has not answered for " + std::to_string(patience.count()) + " s");
    }
  }
  if (outcome == GL_WAIT_FAILED) LoseDevice("it does not wait for a fence");
}

int64_t TimerQuery::ElapsedUs() const {
  GLuint64 elapsed_ns = 0;
  glGetQueryObjectui64v(name_, GL_QUERY_RESULT, &elapsed_ns);
  return static_cast<int64_t>(elapsed_ns / 1000);
}

}  // namespace drape::gl
