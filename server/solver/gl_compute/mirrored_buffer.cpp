#include "server/solver/gl_compute/mirrored_buffer.h"

#include <algorithm>
#include <cstring>

#include "server/solver/gl_compute/device_arena.h"

namespace drape {

namespace {

constexpr uint64_t kFirstSizeBytes = 64 * 1024;
// Two changed parts this close go in one transfer: cheaper than two calls.
constexpr uint64_t kMergeGapBytes = 4 * 1024;

}  // namespace

Result<MirroredBuffer> MirroredBuffer::Create(std::string name, int64_t max_bytes) {
  Result<gl::Buffer> buffer =
      gl::Buffer::Create(std::min(kFirstSizeBytes, static_cast<uint64_t>(max_bytes)));
  if (!buffer.ok()) return buffer.status();
  return MirroredBuffer(std::move(name), static_cast<uint64_t>(max_bytes),
                        std::move(buffer).value());
}

Status MirroredBuffer::Reserve(uint64_t size_bytes) {
  if (size_bytes <= mirror_.size()) return Status::Ok();
  if (size_bytes > max_bytes_) {
    return Status(StatusCode::kResourceExhausted, "DEVICE_MEMORY",
                  "the device array \"" + name_ + "\" would need " + std::to_string(size_bytes) +
                      " bytes, its limit is " + std::to_string(max_bytes_));
  }
  const uint64_t grown_bytes = std::clamp<uint64_t>(2 * mirror_.size(), size_bytes, max_bytes_);
  Result<gl::Buffer> grown = gl::Buffer::Create(grown_bytes);
  if (!grown.ok()) return grown.status();
  buffer_ = std::move(grown).value();
  mirror_.resize(grown_bytes);
  dirty_.assign(1, {0, mirror_.size()});
  return Status::Ok();
}

void MirroredBuffer::Write(uint64_t offset_bytes, std::span<const std::byte> bytes) {
  DRAPE_CHECK(offset_bytes + bytes.size() <= mirror_.size(), "write beyond what was reserved");
  if (bytes.empty() ||
      std::memcmp(mirror_.data() + offset_bytes, bytes.data(), bytes.size()) == 0) {
    return;
  }
  std::memcpy(mirror_.data() + offset_bytes, bytes.data(), bytes.size());
  dirty_.emplace_back(offset_bytes, offset_bytes + bytes.size());
}

void MirroredBuffer::Clear(uint64_t offset_bytes, uint64_t size_bytes) {
  const auto begin = mirror_.begin() + static_cast<std::ptrdiff_t>(offset_bytes);
  const auto end = begin + static_cast<std::ptrdiff_t>(size_bytes);
  if (std::all_of(begin, end, [](std::byte byte) { return byte == std::byte{0}; })) return;
  std::fill(begin, end, std::byte{0});
  dirty_.emplace_back(offset_bytes, offset_bytes + size_bytes);
}

uint64_t MirroredBuffer::Flush() {
  std::sort(dirty_.begin(), dirty_.end());
  uint64_t sent_bytes = 0;
  for (size_t first = 0; first < dirty_.size();) {
    const uint64_t begin = dirty_[first].first;
    uint64_t end = dirty_[first].second;
    size_t next = first + 1;
    while (next < dirty_.size() && dirty_[next].first <= end + kMergeGapBytes) {
      end = std::max(end, dirty_[next++].second);
    }
    buffer_.Upload(begin, std::span(mirror_).subspan(begin, end - begin));
    sent_bytes += end - begin;
    first = next;
  }
  dirty_.clear();
  return sent_bytes;
}

Result<MirroredArena> MirroredArena::Create(std::string name, int64_t max_bytes) {
  Result<MirroredBuffer> mirrored = MirroredBuffer::Create(std::move(name), max_bytes);
  if (!mirrored.ok()) return mirrored.status();
  return MirroredArena(std::move(mirrored).value());
}

MirroredArena::MirroredArena(MirroredBuffer mirrored)
    : mirrored_(std::move(mirrored)), free_list_(mirrored_.Mirror().size() / kArenaWordBytes) {}

Result<WordRange> MirroredArena::Allocate(uint64_t words) {
  if (words == 0) return WordRange();
  const uint64_t aligned =
      (words + kArenaAlignmentWords - 1) / kArenaAlignmentWords * kArenaAlignmentWords;
  std::optional<uint64_t> begin = free_list_.Allocate(aligned);
  if (!begin) {
    DRAPE_RETURN_IF_ERROR(mirrored_.Reserve(free_list_.CapacityFor(aligned) * kArenaWordBytes));
    free_list_.Grow(mirrored_.Mirror().size() / kArenaWordBytes);
    begin = free_list_.Allocate(aligned);
  }
  mirrored_.Clear(*begin * kArenaWordBytes, aligned * kArenaWordBytes);
  return WordRange(&free_list_, *begin, words, aligned);
}

void MirroredArena::Write(const WordRange& range, uint32_t first_word,
                          std::span<const uint32_t> words) {
  DRAPE_CHECK(first_word + words.size() <= range.count(), "a write must stay inside its range");
  mirrored_.Write((uint64_t{range.begin()} + first_word) * kArenaWordBytes, std::as_bytes(words));
}

std::vector<uint32_t> MirroredArena::Read(const WordRange& range, uint32_t first_word,
                                          uint32_t count) const {
  DRAPE_CHECK(uint64_t{first_word} + count <= range.count(), "a read must stay inside its range");
  std::vector<uint32_t> words(count);
  if (count == 0) return words;
  std::memcpy(words.data(),
              mirrored_.Mirror().data() + (uint64_t{range.begin()} + first_word) * kArenaWordBytes,
              count * kArenaWordBytes);
  return words;
}

}  // namespace drape
