#include "server/gl/sync.h"

#include "server/core/check.h"

namespace drape::gl {

void WaitForDevice() {
  Fence::Insert().Wait();
}

Fence Fence::Insert() {
  Fence fence;
  fence.sync_ = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
  DRAPE_CHECK(fence.sync_ != nullptr, "the device is lost");
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
  while (outcome == GL_TIMEOUT_EXPIRED) {
    outcome = glClientWaitSync(sync_, GL_SYNC_FLUSH_COMMANDS_BIT, kOneSecond_ns);
  }
  DRAPE_CHECK(outcome != GL_WAIT_FAILED, "the device is lost");
}

int64_t TimerQuery::ElapsedUs() const {
  GLuint64 elapsed_ns = 0;
  glGetQueryObjectui64v(name_, GL_QUERY_RESULT, &elapsed_ns);
  return static_cast<int64_t>(elapsed_ns / 1000);
}

}  // namespace drape::gl
