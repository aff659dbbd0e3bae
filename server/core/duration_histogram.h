// How often something took how long.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace drape {

// Written and read by any thread, without locks: a reader may see one of two members that belong
// together a moment earlier.
class DurationHistogram {
 public:
  // Upper bounds of the buckets [us]; a last bucket holds what took longer.
  static constexpr std::array<int64_t, 13> kBounds_us = {
      100,    250,    500,     1'000,   2'500,     5'000,     10'000,
      25'000, 50'000, 100'000, 250'000, 1'000'000, 10'000'000};

  struct Counts {
    std::array<uint64_t, kBounds_us.size() + 1> buckets{};  // not cumulative
    uint64_t sum_us = 0;
  };

  void Add(int64_t us) {
    size_t k = 0;
    while (k < kBounds_us.size() && us > kBounds_us[k]) ++k;
    buckets_[k].fetch_add(1, std::memory_order_relaxed);
    sum_us_.fetch_add(static_cast<uint64_t>(us > 0 ? us : 0), std::memory_order_relaxed);
  }
  Counts Read() const {
    Counts counts;
    for (size_t k = 0; k < buckets_.size(); ++k) {
      counts.buckets[k] = buckets_[k].load(std::memory_order_relaxed);
    }
    counts.sum_us = sum_us_.load(std::memory_order_relaxed);
    return counts;
  }

 private:
  std::array<std::atomic<uint64_t>, kBounds_us.size() + 1> buckets_{};
  std::atomic<uint64_t> sum_us_{0};
};

}  // namespace drape
