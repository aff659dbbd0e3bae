// How bytes of the host get into buffers.
#pragma once

#include <epoxy/gl.h>

#include <array>
#include <cstddef>
#include <span>

#include "server/gl/sync.h"

namespace drape::gl {

// Memory of the host from which a context copies into its buffers, between what was asked for
// before and what comes later. glNamedBufferSubData promises that, too, but NVIDIA's driver does
// not keep it (drivers.md). Its context must be current in every call.
class Staging {
 public:
  // The bytes may change as soon as it returns.
  void CopyTo(GLuint buffer, size_t offset_bytes, std::span<const std::byte> bytes);
  // The context ends; what it has staged in ends with its share group.
  void Forget();

 private:
  static constexpr size_t kSegmentBytes = size_t{1} << 20;
  static constexpr size_t kSegments = 4;

  bool Map();

  GLuint name_ = 0;
  std::byte* bytes_ = nullptr;
  bool is_refused_ = false;                  // the driver maps no memory
  size_t segment_ = 0, used_bytes_ = 0;      // of the segment that is being filled
  std::array<Fence, kSegments> are_copied_;  // of the others
};

}  // namespace drape::gl
