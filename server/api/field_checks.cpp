#include "server/api/field_checks.h"

#include <algorithm>
#include <string>

#include "server/session/session_limits.h"

namespace drape::api {
namespace {

size_t ElementBytes(v1::PackedArray::DataType type) {
  if (type == v1::PackedArray::FLOAT16 || type == v1::PackedArray::INT16) return 2;
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

bool CheckAllWithin(const FieldPath& path, const DoubleList& values, double max,
                    std::string_view unit, Violations& violations) {
  const Range range{-max, max, unit};
  bool is_legal = true;
  for (int k = 0; k < values.size() && !violations.is_full(); ++k) {
    if (!range.Contains(values[k])) is_legal = violations.InRange(path.At(k), values[k], range);
  }
  return is_legal;
}

bool CheckKnownEnum(const FieldPath& path, int value, const google::protobuf::EnumDescriptor* type,
                    Violations& violations) {
  return violations.Require(type->FindValueByNumber(value) != nullptr, path, [&] {
    std::string names;
    for (int k = 0; k < type->value_count(); ++k) {
      if (type->value(k)->number() != 0)
        names += (names.empty() ? "" : ", ") + type->value(k)->name();
    }
    return std::to_string(value) + " is not a known value of " + type->name() + " (" + names + ")";
  });
}

std::optional<Eigen::Vector3d> CheckVector3(const FieldPath& path, const DoubleList& values,
                                            double max, std::string_view unit,
                                            Violations& violations) {
  if (!violations.Length(path, values.size(), 3, "x, y, z") ||
      !CheckAllWithin(path, values, max, unit, violations))
    return {};
  return Eigen::Vector3d(values[0], values[1], values[2]);
}

Eigen::Vector3d CheckVector3Or(const Eigen::Vector3d& fallback, const FieldPath& path,
                               const DoubleList& values, double max, std::string_view unit,
                               Violations& violations) {
  if (values.empty()) return fallback;
  return CheckVector3(path, values, max, unit, violations).value_or(fallback);
}

std::string CheckWorldName(const FieldPath& path, const std::string& name, Violations& violations) {
  violations.Require(name.size() <= kMaxWorldNameBytes, path, [&] {
    return "has " + std::to_string(name.size()) + " bytes, at most " +
           std::to_string(kMaxWorldNameBytes);
  });
  return name;
}

std::optional<size_t> CheckPackedRows(const FieldPath& path, const v1::PackedArray& array,
                                      std::initializer_list<v1::PackedArray::DataType> types,
                                      uint32_t columns, Violations& violations) {
  const auto is_type = std::find(types.begin(), types.end(), array.data_type()) != types.end();
  if (!violations.Require(is_type, path.Child("data_type"), [&] {
        const std::string& name = v1::PackedArray::DataType_Name(array.data_type());
        return (name.empty() ? std::to_string(array.data_type()) : name) + " is not " +
               TypeNames(types);
      })) {
    return {};
  }
  if (!violations.Require(
          array.shape_size() == 2 && array.shape(1) == columns, path.Child("shape"),
          [&] { return ShapeText(array) + " is not [n, " + std::to_string(columns) + "]"; })) {
    return {};
  }
  const uint64_t expected = uint64_t{array.shape(0)} * columns * ElementBytes(array.data_type());
  if (!violations.Require(array.data().size() == expected, path.Child("data"), [&] {
        return "has " + std::to_string(array.data().size()) + " bytes, needs " +
               std::to_string(expected) + " for shape " + ShapeText(array) + " of " +
               v1::PackedArray::DataType_Name(array.data_type());
      })) {
    return {};
  }
  return array.shape(0);
}

}  // namespace drape::api
