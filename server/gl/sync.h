// Waits for the device and measures its time. The context must be current in every call.
#pragma once

#include <epoxy/gl.h>

#include <cstdint>
#include <utility>

namespace drape::gl {

// Blocks until the device has done all submitted work. Ends the process if the device is lost or
// takes longer than DevicePatience (core/device_loss.h).
void WaitForDevice();

// A point in the submitted work of one context, for all contexts of its share group. Owns the sync
// object. Move-only.
class Fence {
 public:
  // An empty fence: there is nothing to wait for.
  Fence() = default;
  // After all work that the current context has submitted. Flushes the context: other contexts
  // would wait forever for a fence that stays in its queue.
  static Fence Insert();
  // A context of the share group must be current.
  ~Fence();
  Fence(Fence&& other) noexcept { *this = std::move(other); }
  Fence& operator=(Fence&& other) noexcept {
    std::swap(sync_, other.sync_);
    return *this;
  }

  // Work that the current context submits from now on is done after the fence. Does not block the
  // thread.
  void WaitOnDevice() const;
  // Blocks the thread until the device has reached the fence, or the process ends as in
  // WaitForDevice. A context of the share group must be current.
  void Wait() const;
  // The context is gone.
  void Forget() { sync_ = nullptr; }

 private:
  GLsync sync_ = nullptr;
};

// Device time between Start and Stop. One at a time per context.
class TimerQuery {
 public:
  TimerQuery() { glCreateQueries(GL_TIME_ELAPSED, 1, &name_); }
  ~TimerQuery() { glDeleteQueries(1, &name_); }
  TimerQuery(const TimerQuery&) = delete;
  TimerQuery& operator=(const TimerQuery&) = delete;

  void Start() { glBeginQuery(GL_TIME_ELAPSED, name_); }
  void Stop() { glEndQuery(GL_TIME_ELAPSED); }
  // Waits for the device; microseconds.
  int64_t ElapsedUs() const;

 private:
  GLuint name_ = 0;
};

}  // namespace drape::gl
