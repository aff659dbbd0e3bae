// Waiting for the device and measuring its time. Every call with the context current.
#pragma once

#include <epoxy/gl.h>

#include <cstdint>

namespace drape::gl {

// Blocks until the device has done everything submitted before.
void WaitForDevice();

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
