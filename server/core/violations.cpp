#include "server/core/violations.h"

#include <charconv>
#include <utility>

#include "server/core/check.h"

namespace drape {

FieldPath FieldPath::At(size_t index) const {
  FieldPath path(*this);
  path.parts_[path.depth_ - 1].index = static_cast<int64_t>(index);
  return path;
}

FieldPath& FieldPath::Append(std::string_view name) {
  DRAPE_CHECK(depth_ < kMaxDepth, "a field path this deep does not occur in drape.v1");
  parts_[depth_++] = {name, kNoIndex};
  return *this;
}

std::string FieldPath::ToString() const {
  std::string text;
  for (size_t k = 0; k < depth_; ++k) {
    if (k > 0) text += '.';
    text += parts_[k].name;
    if (parts_[k].index != kNoIndex) text += '[' + std::to_string(parts_[k].index) + ']';
  }
  return text;
}

std::string NumberText(double value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(std::begin(buffer), std::end(buffer), value);
  return error == std::errc() ? std::string(buffer, end) : std::to_string(value);
}

std::string Range::ToString() const {
  return (includes_low ? "[" : "(") + NumberText(low) + ", " + NumberText(high) +
         (includes_high ? "]" : ")") + (unit.empty() ? "" : " ") + std::string(unit);
}

void Violations::Add(const FieldPath& path, std::string description) {
  if (!is_full()) list_.push_back({path.ToString(), std::move(description)});
}

void Violations::AddAll(const std::vector<FieldViolation>& violations, std::string_view prefix) {
  for (const FieldViolation& violation : violations) {
    if (is_full()) return;
    list_.push_back({std::string(prefix) + violation.field, violation.description});
  }
}

bool Violations::InRange(const FieldPath& path, double value, const Range& range) {
  return Require(range.Contains(value), path,
                 [&] { return NumberText(value) + " is not in " + range.ToString(); });
}

bool Violations::CountInRange(const FieldPath& path, uint64_t value, uint64_t min, uint64_t max) {
  return Require(value >= min && value <= max, path, [&] {
    return std::to_string(value) + " is not in [" + std::to_string(min) + ", " +
           std::to_string(max) + "]";
  });
}

bool Violations::IsParticle(const FieldPath& path, uint64_t index, uint64_t count) {
  if (count > 0) return CountInRange(path, index, 0, count - 1);
  Add(path, std::to_string(index) + ": there are no particles");
  return false;
}

bool Violations::Length(const FieldPath& path, size_t actual, size_t expected,
                        std::string_view meaning) {
  return Require(actual == expected, path, [&] {
    return "has " + std::to_string(actual) + " elements, needs " + std::to_string(expected) + " (" +
           std::string(meaning) + ")";
  });
}

Status Violations::ToStatus() const {
  return is_empty() ? Status::Ok() : Status::InvalidFields(list_);
}

Status Below(const FieldPath& path, const Status& status) {
  if (status.violations().empty()) return status;
  std::vector<FieldViolation> violations = status.violations();
  for (FieldViolation& violation : violations) violation.field.insert(0, path.ToString() + ".");
  return Status::InvalidFields(std::move(violations));
}

}  // namespace drape
