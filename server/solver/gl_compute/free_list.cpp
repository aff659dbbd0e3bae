#include "server/solver/gl_compute/free_list.h"

#include <iterator>

#include "server/core/check.h"

namespace drape {

std::optional<uint64_t> FreeList::Allocate(uint64_t count) {
  DRAPE_CHECK(count > 0, "an allocation needs a size");
  for (auto gap = gaps_.begin(); gap != gaps_.end(); ++gap) {
    const auto [begin, size] = *gap;
    if (size < count) continue;
    gaps_.erase(gap);
    if (size > count) gaps_.emplace(begin + count, size - count);
    free_count_ -= count;
    return begin;
  }
  return std::nullopt;
}

void FreeList::Free(uint64_t begin, uint64_t count) {
  DRAPE_CHECK(count > 0 && begin + count <= capacity_, "freed words must exist");
  free_count_ += count;
  auto next = gaps_.lower_bound(begin);
  DRAPE_CHECK(next == gaps_.end() || begin + count <= next->first, "words freed twice");
  if (next != gaps_.end() && begin + count == next->first) {
    count += next->second;
    next = gaps_.erase(next);
  }
  if (next != gaps_.begin()) {
    const auto previous = std::prev(next);
    DRAPE_CHECK(previous->first + previous->second <= begin, "words freed twice");
    if (previous->first + previous->second == begin) {
      previous->second += count;
      return;
    }
  }
  gaps_.emplace(begin, count);
}

void FreeList::Grow(uint64_t capacity) {
  DRAPE_CHECK(capacity >= capacity_, "a free list does not shrink");
  const uint64_t old_capacity = capacity_;
  capacity_ = capacity;
  if (capacity > old_capacity) Free(old_capacity, capacity - old_capacity);
}

uint64_t FreeList::CapacityFor(uint64_t count) const {
  if (gaps_.empty()) return capacity_ + count;
  const auto [begin, size] = *gaps_.rbegin();
  const uint64_t tail = begin + size == capacity_ ? size : 0;
  return tail >= count ? capacity_ : capacity_ - tail + count;
}

}  // namespace drape
