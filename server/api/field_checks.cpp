#include "server/api/field_checks.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace drape::api {
namespace {

size_t ElementBytes(v1::PackedArray::DataType type) {
  return type == v1::PackedArray::FLOAT64 ? 8 : 4;
}

std::string TypeNames(std::initializer_list<v1::PackedArray::DataType> types) {
  std::string names;
  for (const auto type : types) {
    names += (names.empty() ? "" : " or ") + v1::PackedArray::DataType_Name(type);
  }
  return names;
}

std::string ShapeText(const v1::PackedArray& array) {
  constexpr int kShownExtents = 4;
  std::string text = "[";
  for (int k = 0; k < std::min(array.shape_size(), kShownExtents); ++k) {
    text += (k > 0 ? ", " : "") + std::to_string(array.shape(k));
  }
  return text + (array.shape_size() > kShownExtents ? ", ...]" : "]");
}

}  // namespace

FieldPath FieldPath::At(size_t index) const {
  FieldPath path(*this);
  path.parts_[path.depth_ - 1].index = static_cast<int64_t>(index);
  return path;
}

FieldPath& FieldPath::Append(std::string_view name, int64_t index) {
  DRAPE_CHECK(depth_ < kMaxDepth, "a field path this deep does not occur in drape.v1");
  parts_[depth_++] = {name, index};
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

void FieldChecks::Add(const FieldPath& path, std::string description) {
  if (!is_full()) violations_.push_back({path.ToString(), std::move(description)});
}

void FieldChecks::AddAll(const std::vector<FieldViolation>& violations, std::string_view prefix) {
  for (const FieldViolation& violation : violations) {
    if (is_full()) return;
    violations_.push_back({std::string(prefix) + violation.field, violation.description});
  }
}

bool FieldChecks::InRange(const FieldPath& path, double value, double min, double max,
                          std::string_view unit) {
  return Require(value >= min && value <= max, path, [&] {
    return NumberText(value) + " is not in [" + NumberText(min) + ", " + NumberText(max) + "]" +
           (unit.empty() ? "" : " ") + std::string(unit);
  });
}

bool FieldChecks::CountInRange(const FieldPath& path, uint64_t value, uint64_t min, uint64_t max) {
  return Require(value >= min && value <= max, path, [&] {
    return std::to_string(value) + " is not in [" + std::to_string(min) + ", " +
           std::to_string(max) + "]";
  });
}

bool FieldChecks::Length(const FieldPath& path, size_t actual, size_t expected,
                         std::string_view meaning) {
  return Require(actual == expected, path, [&] {
    return "has " + std::to_string(actual) + " elements, needs " + std::to_string(expected) + " (" +
           std::string(meaning) + ")";
  });
}

bool FieldChecks::AllWithin(const FieldPath& path, const DoubleList& values, double max,
                            std::string_view unit) {
  bool is_legal = true;
  for (int k = 0; k < values.size() && !is_full(); ++k) {
    if (!(std::abs(values[k]) <= max)) is_legal = InRange(path.At(k), values[k], -max, max, unit);
  }
  return is_legal;
}

bool FieldChecks::KnownEnum(const FieldPath& path, int value,
                            const google::protobuf::EnumDescriptor* type) {
  return Require(type->FindValueByNumber(value) != nullptr, path, [&] {
    std::string names;
    for (int k = 0; k < type->value_count(); ++k) {
      if (type->value(k)->number() != 0)
        names += (names.empty() ? "" : ", ") + type->value(k)->name();
    }
    return std::to_string(value) + " is not a known value of " + type->name() + " (" + names + ")";
  });
}

std::optional<Eigen::Vector3d> FieldChecks::Vector3(const FieldPath& path, const DoubleList& values,
                                                    double max, std::string_view unit) {
  if (!Length(path, values.size(), 3, "x, y, z") || !AllWithin(path, values, max, unit)) return {};
  return Eigen::Vector3d(values[0], values[1], values[2]);
}

Eigen::Vector3d FieldChecks::Vector3Or(const Eigen::Vector3d& fallback, const FieldPath& path,
                                       const DoubleList& values, double max,
                                       std::string_view unit) {
  if (values.empty()) return fallback;
  return Vector3(path, values, max, unit).value_or(fallback);
}

std::optional<size_t> FieldChecks::PackedRows(
    const FieldPath& path, const v1::PackedArray& array,
    std::initializer_list<v1::PackedArray::DataType> types, uint32_t columns) {
  const auto is_type = std::find(types.begin(), types.end(), array.data_type()) != types.end();
  if (!Require(is_type, path.Child("data_type"), [&] {
        const std::string& name = v1::PackedArray::DataType_Name(array.data_type());
        return (name.empty() ? std::to_string(array.data_type()) : name) + " is not " +
               TypeNames(types);
      })) {
    return {};
  }
  if (!Require(array.shape_size() == 2 && array.shape(1) == columns, path.Child("shape"),
               [&] { return ShapeText(array) + " is not [n, " + std::to_string(columns) + "]"; })) {
    return {};
  }
  const uint64_t expected = uint64_t{array.shape(0)} * columns * ElementBytes(array.data_type());
  if (!Require(array.data().size() == expected, path.Child("data"), [&] {
        return "has " + std::to_string(array.data().size()) + " bytes, needs " +
               std::to_string(expected) + " for shape " + ShapeText(array) + " of " +
               v1::PackedArray::DataType_Name(array.data_type());
      })) {
    return {};
  }
  return array.shape(0);
}

Status FieldChecks::ToStatus() const {
  return ok() ? Status::Ok() : Status::InvalidFields(violations_);
}

}  // namespace drape::api
