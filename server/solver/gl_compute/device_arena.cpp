#include "server/solver/gl_compute/device_arena.h"

#include <algorithm>
#include <limits>

namespace drape {

namespace {

constexpr uint64_t kWordBytes = kArenaWordBytes;
constexpr uint64_t kFirstCapacityWords = 16 * 1024;
// While an array grows, the old one and the new one exist: large ones grow by less than doubling.
constexpr uint64_t kMostGrowthWords = 64 * 1024 * 1024;

uint64_t Aligned(uint64_t words) {
  return (words + kArenaAlignmentWords - 1) / kArenaAlignmentWords * kArenaAlignmentWords;
}

}  // namespace

Result<DeviceArena> DeviceArena::Create(std::string name, int64_t max_bytes) {
  // Offsets in records are 32-bit word counts.
  const uint64_t max_words =
      std::min<uint64_t>(max_bytes / kWordBytes, std::numeric_limits<uint32_t>::max());
  const uint64_t capacity = std::min(kFirstCapacityWords, max_words);
  Result<gl::Buffer> buffer = gl::Buffer::Create(capacity * kWordBytes);
  if (!buffer.ok()) return buffer.status();
  return DeviceArena(std::move(name), max_words, std::move(buffer).value(), capacity);
}

Result<WordRange> DeviceArena::Allocate(uint64_t words) {
  std::optional<WordRange> range = AllocateWithin(words);
  if (!range) {
    DRAPE_RETURN_IF_ERROR(GrowFor(Aligned(words)));
    range = AllocateWithin(words);
  }
  return std::move(*range);
}

std::optional<WordRange> DeviceArena::AllocateWithin(uint64_t words) {
  if (words == 0) return WordRange();
  const uint64_t aligned = Aligned(words);
  const std::optional<uint64_t> begin = free_list_.Allocate(aligned);
  if (!begin) return std::nullopt;
  buffer_.Clear(*begin * kWordBytes, aligned * kWordBytes);
  return WordRange(&free_list_, *begin, words, aligned);
}

bool DeviceArena::CanGrowFor(uint64_t words) const {
  return free_list_.CapacityFor(Aligned(words)) <= max_words_;
}

bool DeviceArena::IsAllowed(uint64_t words) const {
  return Aligned(words) <= max_words_;
}

// Small arrays double, so that n allocations copy O(n) words.
Status DeviceArena::GrowFor(uint64_t words) {
  const uint64_t needed = free_list_.CapacityFor(words);
  if (needed > max_words_) {
    return Status(StatusCode::kResourceExhausted, "DEVICE_MEMORY",
                  "the device array \"" + name_ + "\" would need " +
                      std::to_string(needed * kWordBytes) + " bytes, its limit is " +
                      std::to_string(max_words_ * kWordBytes));
  }
  uint64_t capacity =
      std::clamp(free_list_.capacity() + std::min(free_list_.capacity(), kMostGrowthWords), needed,
                 max_words_);
  Result<gl::Buffer> grown = gl::Buffer::Create(capacity * kWordBytes);
  if (!grown.ok() && capacity > needed) {
    capacity = needed;
    grown = gl::Buffer::Create(capacity * kWordBytes);
  }
  if (!grown.ok()) return grown.status();
  grown->CopyFrom(buffer_, free_list_.capacity() * kWordBytes);
  buffer_ = std::move(grown).value();
  free_list_.Grow(capacity);
  return Status::Ok();
}

void DeviceArena::Write(const WordRange& range, uint32_t first_word,
                        std::span<const uint32_t> words) {
  WriteBytes(range, first_word, std::as_bytes(words));
}

void DeviceArena::Write(const WordRange& range, uint32_t first_word, std::span<const float> words) {
  WriteBytes(range, first_word, std::as_bytes(words));
}

void DeviceArena::WriteBytes(const WordRange& range, uint32_t first_word,
                             std::span<const std::byte> bytes) {
  DRAPE_CHECK(first_word * kWordBytes + bytes.size() <= range.count() * kWordBytes,
              "a write must stay inside its range");
  buffer_.Upload((uint64_t{range.begin()} + first_word) * kWordBytes, bytes);
}

}  // namespace drape
