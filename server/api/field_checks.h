// Small checks that name the field, its value and the legal range, and collect every violation.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/repeated_field.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drape/v1/array.pb.h"
#include "server/core/status.h"

namespace drape::api {

// No length, mass or coefficient of a cloth in SI units lies outside; inside, single precision
// neither overflows nor loses a reciprocal.
inline constexpr double kMaxMagnitude = 1e12;
inline constexpr double kMinPositive = 1e-12;

// The way to a field of a request, e.g. spec.pins[2].particle. Cheap to copy; text only on demand.
class FieldPath {
 public:
  // Names must outlive the path: string literals.
  explicit FieldPath(std::string_view name) { Append(name, kNoIndex); }

  FieldPath Child(std::string_view name) const { return FieldPath(*this).Append(name, kNoIndex); }
  FieldPath At(size_t index) const;
  std::string ToString() const;

 private:
  static constexpr int64_t kNoIndex = -1;
  static constexpr size_t kMaxDepth = 6;
  struct Part {
    std::string_view name;
    int64_t index = kNoIndex;
  };
  FieldPath& Append(std::string_view name, int64_t index);

  std::array<Part, kMaxDepth> parts_;
  size_t depth_ = 0;
};

// The shortest decimal text that reads back as `value`; "nan", "inf", "-inf".
std::string NumberText(double value);

using DoubleList = google::protobuf::RepeatedField<double>;

// Collects at most kMaxViolations. Each check returns whether the value is legal.
class FieldChecks {
 public:
  static constexpr size_t kMaxViolations = 16;

  void Add(const FieldPath& path, std::string description);
  // Those that a lower layer found; `prefix` is put before each field.
  void AddAll(const std::vector<FieldViolation>& violations, std::string_view prefix = "");
  // `description` is only made when `is_legal` is false.
  template <class Describe>
  bool Require(bool is_legal, const FieldPath& path, Describe&& description) {
    if (!is_legal) Add(path, description());
    return is_legal;
  }

  // In [min, max]; false for NaN. `unit` may be empty.
  bool InRange(const FieldPath& path, double value, double min, double max, std::string_view unit);
  bool CountInRange(const FieldPath& path, uint64_t value, uint64_t min, uint64_t max);
  // Exactly `expected` elements; `meaning` says why, e.g. "3 per particle".
  bool Length(const FieldPath& path, size_t actual, size_t expected, std::string_view meaning);
  // Every |value| <= max.
  bool AllWithin(const FieldPath& path, const DoubleList& values, double max,
                 std::string_view unit);
  bool KnownEnum(const FieldPath& path, int value, const google::protobuf::EnumDescriptor* type);

  // Three numbers, each of magnitude <= max; none after a violation.
  std::optional<Eigen::Vector3d> Vector3(const FieldPath& path, const DoubleList& values,
                                         double max, std::string_view unit);
  // The same, or `fallback`: where there are no numbers, and after a violation.
  Eigen::Vector3d Vector3Or(const Eigen::Vector3d& fallback, const FieldPath& path,
                            const DoubleList& values, double max, std::string_view unit);
  // Data type one of `types`, shape [rows, columns], data of exactly that many bytes. The rows, or
  // none after a violation.
  std::optional<size_t> PackedRows(const FieldPath& path, const v1::PackedArray& array,
                                   std::initializer_list<v1::PackedArray::DataType> types,
                                   uint32_t columns);

  bool ok() const { return violations_.empty(); }
  size_t violation_count() const { return violations_.size(); }
  // Further violations would be dropped: a loop over a long list may stop.
  bool is_full() const { return violations_.size() >= kMaxViolations; }
  // OK, or INVALID_ARGUMENT with all of them.
  Status ToStatus() const;

 private:
  std::vector<FieldViolation> violations_;
};

}  // namespace drape::api
