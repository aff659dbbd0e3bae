// A copy of device memory for the other contexts of a share group.
#pragma once

#include "server/gl/buffer.h"
#include "server/gl/sync.h"

namespace drape::gl {

// Whoever reads the buffer first does `ready.WaitOnDevice()`. Made on one thread, read on another;
// destroyed with any context of the share group current.
struct SharedCopy {
  Buffer buffer;
  Fence ready;
};

}  // namespace drape::gl
