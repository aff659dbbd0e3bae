// The graphics layer's definition of DeviceCopy (server/solver/device_backend.h).
#pragma once

#include "server/gl/buffer.h"
#include "server/gl/sync.h"

namespace drape {

// A copy of device memory for the other contexts of a share group. A reader calls
// `ready.WaitOnDevice()` before its first use of the buffer. Made on one thread, read on another;
// destroyed with any context of the share group current.
struct DeviceCopy {
  gl::Buffer buffer;
  gl::Fence ready;
};

}  // namespace drape
