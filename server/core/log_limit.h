// Keeps lines that clients cause from filling the log.
#pragma once

#include <cstdint>
#include <mutex>

namespace drape {

// Lets some events of each second through and counts the others. Thread-safe.
class LogLimit {
 public:
  explicit LogLimit(uint32_t max_per_s) : max_per_s_(max_per_s) {}

  struct Verdict {
    bool is_admitted = false;
    uint64_t left_out = 0;  // since the last second that had some; with the first admitted event
  };
  Verdict Ask(int64_t now_us) {
    const std::lock_guard lock(mutex_);
    const int64_t second = now_us / 1'000'000;
    if (second != second_) {
      second_ = second;
      admitted_ = 0;
    }
    if (admitted_ == max_per_s_) {
      ++left_out_;
      return {};
    }
    ++admitted_;
    const Verdict verdict{true, left_out_};
    left_out_ = 0;
    return verdict;
  }

 private:
  const uint32_t max_per_s_;
  std::mutex mutex_;
  int64_t second_ = -1;
  uint32_t admitted_ = 0;
  uint64_t left_out_ = 0;
};

}  // namespace drape
