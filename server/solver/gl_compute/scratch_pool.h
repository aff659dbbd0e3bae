// Memory of cloths that only kernels use, in as many arrays as the device's limit makes necessary.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "server/core/status.h"
#include "server/gl/buffer.h"
#include "server/solver/gl_compute/device_arena.h"

namespace drape {

// Words of one array of the pool.
class ScratchRange {
 public:
  ScratchRange() = default;
  ScratchRange(uint32_t array, WordRange words) : array_(array), words_(std::move(words)) {}

  uint32_t array() const { return array_; }
  // Within the array.
  uint32_t begin() const { return words_.begin(); }

 private:
  uint32_t array_ = 0;
  WordRange words_{};
};

// Storage blocks end at 2^31 bytes on most drivers; 16 384 cloths may need more scratch memory. A
// dispatch sees one array, so cloths of different arrays take different dispatches; a new array is
// begun only when no other has room. Must not move once ranges exist. Every call with the context
// current.
class ScratchPool {
 public:
  // `max_bytes`: the largest size of one array. RESOURCE_EXHAUSTED (DEVICE_MEMORY).
  static Result<ScratchPool> Create(int64_t max_bytes);

  // RESOURCE_EXHAUSTED (DEVICE_MEMORY); nothing changes then.
  Result<ScratchRange> Allocate(uint64_t words);
  // May be another buffer after an Allocate.
  const gl::Buffer& buffer(uint32_t array) const { return arrays_[array]->buffer(); }
  size_t array_count() const { return arrays_.size(); }

 private:
  explicit ScratchPool(int64_t max_bytes) : max_bytes_(max_bytes) {}
  Status AddArray();

  int64_t max_bytes_;
  std::vector<std::unique_ptr<DeviceArena>> arrays_;
};

}  // namespace drape
