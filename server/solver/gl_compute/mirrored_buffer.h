// A device array whose contents the host keeps too, so that only changes are sent.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/core/status.h"
#include "server/gl/buffer.h"
#include "server/solver/gl_compute/free_list.h"

namespace drape {

// Writes go to the host's copy; Flush sends the changed parts in few transfers. Every call with the
// context current.
class MirroredBuffer {
 public:
  static Result<MirroredBuffer> Create(std::string name, int64_t max_bytes);

  // Makes room for `size_bytes`. RESOURCE_EXHAUSTED (DEVICE_MEMORY); nothing changes then.
  Status Reserve(uint64_t size_bytes);
  // Bytes that are already equal are not sent.
  void Write(uint64_t offset_bytes, std::span<const std::byte> bytes);
  void Clear(uint64_t offset_bytes, uint64_t size_bytes);
  std::span<const std::byte> Mirror() const { return mirror_; }
  // Returns the bytes sent.
  uint64_t Flush();

  const gl::Buffer& buffer() const { return buffer_; }

 private:
  MirroredBuffer(std::string name, uint64_t max_bytes, gl::Buffer buffer)
      : name_(std::move(name)),
        max_bytes_(max_bytes),
        buffer_(std::move(buffer)),
        mirror_(buffer_.size_bytes()),
        dirty_(1, {0, mirror_.size()}) {}

  std::string name_;
  uint64_t max_bytes_;
  gl::Buffer buffer_;
  std::vector<std::byte> mirror_;
  // Changed bytes, [begin, end). All of a new buffer: the driver's memory may have any content.
  std::vector<std::pair<uint64_t, uint64_t>> dirty_;
};

// A mirrored buffer of 4-byte words, handed out in ranges of zeros (as DeviceArena). Must not move
// once ranges exist.
class MirroredArena {
 public:
  static Result<MirroredArena> Create(std::string name, int64_t max_bytes);

  // RESOURCE_EXHAUSTED (DEVICE_MEMORY); nothing changes then. 0 words are an empty range.
  Result<WordRange> Allocate(uint64_t words);
  void Write(const WordRange& range, uint32_t first_word, std::span<const uint32_t> words);
  // The words that were written last: `count` of them from `first_word`.
  std::vector<uint32_t> Read(const WordRange& range, uint32_t first_word, uint32_t count) const;
  uint64_t Flush() { return mirrored_.Flush(); }

  const gl::Buffer& buffer() const { return mirrored_.buffer(); }

 private:
  explicit MirroredArena(MirroredBuffer mirrored);

  MirroredBuffer mirrored_;
  FreeList free_list_;
};

}  // namespace drape
