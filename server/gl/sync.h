// Waiting for the device and measuring its time. Every call with the context current.
#pragma once

#include <epoxy/gl.h>

#include <cstdint>
#include <utility>

namespace drape::gl {

// Blocks until the device has done everything submitted before. Aborts if it is lost: its memory is
// gone, and only a new process can have it again.
void WaitForDevice();

// A point in the work submitted by one context, for it and the others of its share group. Owns the
// sync object. Move-only.
class Fence {
 public:
  // Null: there is nothing to wait for.
  Fence() = default;
  // After everything that the current context has submitted, which is sent to the device: a fence
  // that stayed in this context's queue would never be reached for the others.
  static Fence Insert();
  // With a context of the share group current.
  ~Fence();
  Fence(Fence&& other) noexcept { *this = std::move(other); }
  Fence& operator=(Fence&& other) noexcept {
    std::swap(sync_, other.sync_);
    return *this;
  }

  // What the current context submits from here on is done after the fence. Does not block the
  // thread.
  void WaitOnDevice() const;
  // Blocks the thread until the device has come to the fence; aborts as WaitForDevice. With a
  // context of the share group current.
  void Wait() const;

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
