// The errors of an input, field by field: paths to fields, ranges of numbers, and the list of
// violations.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/core/status.h"

namespace drape {

// The way to a field of a request, e.g. spec.pins[2].particle. Cheap to copy; text only on demand.
class FieldPath {
 public:
  FieldPath() = default;  // the request itself
  // Names must outlive the path: string literals.
  FieldPath(const char* name) { Append(name); }  // NOLINT: implicit, so that a literal is a path
  explicit FieldPath(std::string_view name) { Append(name); }

  FieldPath Child(std::string_view name) const { return FieldPath(*this).Append(name); }
  FieldPath At(size_t index) const;
  std::string ToString() const;

 private:
  static constexpr int64_t kNoIndex = -1;
  static constexpr size_t kMaxDepth = 6;
  struct Part {
    std::string_view name;
    int64_t index = kNoIndex;
  };
  FieldPath& Append(std::string_view name);

  std::array<Part, kMaxDepth> parts_;
  size_t depth_ = 0;
};

// The shortest decimal text that reads back as `value`; "nan", "inf", "-inf".
std::string NumberText(double value);

// The legal values of a number. NaN is in no range.
struct Range {
  double low = 0;
  double high = 0;
  std::string_view unit{};  // may be empty
  bool includes_low = true;
  bool includes_high = true;

  constexpr bool Contains(double value) const {
    return (includes_low ? value >= low : value > low) &&
           (includes_high ? value <= high : value < high);
  }
  // "(0, 10] s"
  std::string ToString() const;
};

// The range (0, high].
constexpr Range Positive(double high, std::string_view unit) {
  return {.low = 0, .high = high, .unit = unit, .includes_low = false};
}

// The range [0, high).
constexpr Range FromZeroBelow(double high) {
  return {.low = 0, .high = high, .includes_high = false};
}

// Collects violations up to a limit: a thousand of one kind tell no more than the first few. Each
// check returns whether the value is legal.
class Violations {
 public:
  static constexpr size_t kMaxCount = 16;

  void Add(const FieldPath& path, std::string description);
  // Adds the violations that a lower layer found, with `prefix` before each field.
  void AddAll(const std::vector<FieldViolation>& violations, std::string_view prefix = "");
  // `description` is only made when `is_legal` is false and it would not be dropped.
  template <class Describe>
  bool Require(bool is_legal, const FieldPath& path, Describe&& description) {
    if (!is_legal && !is_full()) Add(path, description());
    return is_legal;
  }

  bool InRange(const FieldPath& path, double value, const Range& range);
  bool CountInRange(const FieldPath& path, uint64_t value, uint64_t min, uint64_t max);
  // Requires an index below the number of particles.
  bool IsParticle(const FieldPath& path, uint64_t index, uint64_t count);
  // Requires exactly `expected` elements; `meaning` says why, e.g. "3 per particle".
  bool Length(const FieldPath& path, size_t actual, size_t expected, std::string_view meaning);

  bool is_empty() const { return list_.empty(); }
  // Further violations would be dropped, so a loop over a long list may stop.
  bool is_full() const { return list_.size() >= kMaxCount; }
  size_t count() const { return list_.size(); }
  // OK, or INVALID_ARGUMENT with all of them.
  Status ToStatus() const;
  std::vector<FieldViolation> Take() { return std::move(list_); }

 private:
  std::vector<FieldViolation> list_;
};

// The same status with each of its fields below `path`: "pins[2]" becomes "spec.pins[2]". Unchanged
// without field violations.
Status Below(const FieldPath& path, const Status& status);

}  // namespace drape
