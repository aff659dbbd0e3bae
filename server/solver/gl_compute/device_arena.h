// Growing arrays on the device that many cloths share.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "server/core/status.h"
#include "server/gl/buffer.h"
#include "server/solver/gl_compute/free_list.h"

namespace drape {

// One storage buffer of 4-byte words, handed out in ranges of zeros: whatever another tenant had
// there before is gone, and so is what the driver's memory held. It grows by copying itself on the
// device, so ranges keep their offsets. Every call with the context current.
class DeviceArena {
 public:
  // `name` is for messages; `max_bytes` is the largest size the device binds as one block.
  static Result<DeviceArena> Create(std::string name, int64_t max_bytes);

  // RESOURCE_EXHAUSTED (DEVICE_MEMORY); the arena is unchanged then. 0 words are an empty range.
  Result<WordRange> Allocate(uint64_t words);
  // Without growing; none: there is no gap for them.
  std::optional<WordRange> AllocateWithin(uint64_t words);
  // Whether Allocate would stay within the largest size: of the array as it is, of an empty one.
  bool CanGrowFor(uint64_t words) const;
  bool IsAllowed(uint64_t words) const;
  void Write(const WordRange& range, uint32_t first_word, std::span<const uint32_t> words);
  void Write(const WordRange& range, uint32_t first_word, std::span<const float> words);

  const gl::Buffer& buffer() const { return buffer_; }
  uint64_t capacity_words() const { return free_list_.capacity(); }
  uint64_t free_words() const { return free_list_.free_count(); }

 private:
  DeviceArena(std::string name, uint64_t max_words, gl::Buffer buffer, uint64_t capacity_words)
      : name_(std::move(name)),
        max_words_(max_words),
        buffer_(std::move(buffer)),
        free_list_(capacity_words) {}
  Status GrowFor(uint64_t words);
  void WriteBytes(const WordRange& range, uint32_t first_word, std::span<const std::byte> bytes);

  std::string name_;
  uint64_t max_words_;
  gl::Buffer buffer_;
  FreeList free_list_;
};

// Ranges start at multiples of this many words, a cache line, so that no two cloths write the same
// line.
inline constexpr uint64_t kArenaAlignmentWords = 32;
inline constexpr uint64_t kArenaWordBytes = 4;

}  // namespace drape
