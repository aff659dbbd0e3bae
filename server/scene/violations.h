// Violations of an input, field by field.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/core/status.h"

namespace drape {

// Collects violations up to a limit: a thousand of one kind say no more than the first few.
class Violations {
 public:
  static constexpr size_t kMaxCount = 16;

  bool is_full() const { return list_.size() >= kMaxCount; }
  bool is_empty() const { return list_.empty(); }
  void Add(std::string field, std::string description) {
    if (!is_full()) list_.push_back({std::move(field), std::move(description)});
  }
  // NaN is in no range.
  void CheckRange(std::string_view field, double value, double low, double high,
                  std::string_view unit) {
    if (value >= low && value <= high) return;
    Add(std::string(field),
        fmt::format("{} is not in [{}, {}]{}{}", value, low, high, unit.empty() ? "" : " ", unit));
  }
  void CheckPositive(std::string_view field, double value, double high, std::string_view unit) {
    if (value > 0 && value <= high) return;
    Add(std::string(field), fmt::format("{} is not in (0, {}] {}", value, high, unit));
  }
  void CheckIndex(std::string field, uint64_t index, uint64_t count) {
    if (index < count) return;
    Add(std::move(field), count == 0 ? fmt::format("{}: there are no particles", index)
                                     : fmt::format("{} is not in [0, {}]", index, count - 1));
  }
  std::vector<FieldViolation> Take() { return std::move(list_); }

 private:
  std::vector<FieldViolation> list_;
};

}  // namespace drape
