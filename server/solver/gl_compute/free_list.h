// The words of an array that are not taken. Pure.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>

namespace drape {

// First fit over [0, capacity) with merging of neighbours. Units are the caller's.
class FreeList {
 public:
  explicit FreeList(uint64_t capacity) { Grow(capacity); }

  uint64_t capacity() const { return capacity_; }
  uint64_t free_count() const { return free_count_; }

  // `count` > 0. Nothing if no gap is large enough.
  std::optional<uint64_t> Allocate(uint64_t count);
  void Free(uint64_t begin, uint64_t count);
  // To at least the present capacity.
  void Grow(uint64_t capacity);
  // The capacity at which Allocate(count) would succeed.
  uint64_t CapacityFor(uint64_t count) const;

 private:
  uint64_t capacity_ = 0;
  uint64_t free_count_ = 0;
  std::map<uint64_t, uint64_t> gaps_;  // begin -> count
};

// Some words of a free list, given back on destruction. The list must outlive it and not move.
// Move-only.
class WordRange {
 public:
  WordRange() = default;
  // `reserved` >= `count`: the words taken from the list.
  WordRange(FreeList* list, uint64_t begin, uint64_t count, uint64_t reserved)
      : list_(list),
        begin_(static_cast<uint32_t>(begin)),
        count_(static_cast<uint32_t>(count)),
        reserved_(reserved) {}
  ~WordRange() {
    if (list_ != nullptr) list_->Free(begin_, reserved_);
  }
  WordRange(WordRange&& other) noexcept { *this = std::move(other); }
  WordRange& operator=(WordRange&& other) noexcept {
    std::swap(list_, other.list_);
    std::swap(begin_, other.begin_);
    std::swap(count_, other.count_);
    std::swap(reserved_, other.reserved_);
    return *this;
  }

  uint32_t begin() const { return begin_; }
  uint32_t count() const { return count_; }

 private:
  FreeList* list_ = nullptr;
  uint32_t begin_ = 0;
  uint32_t count_ = 0;
  uint64_t reserved_ = 0;
};

}  // namespace drape
