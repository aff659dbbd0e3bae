// Checks of what only messages have: lists of numbers, enums, packed arrays.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/repeated_field.h>

#include <Eigen/Core>
#include <optional>
#include <string_view>

#include "drape/v1/array.pb.h"
#include "server/core/violations.h"

namespace drape::api {

// No length, mass or coefficient of a cloth in SI units lies outside; inside, single precision
// neither overflows nor loses a reciprocal.
inline constexpr double kMaxMagnitude = 1e12;
inline constexpr double kMinPositive = 1e-12;

using DoubleList = google::protobuf::RepeatedField<double>;

// Every |value| <= max.
bool CheckAllWithin(const FieldPath& path, const DoubleList& values, double max,
                    std::string_view unit, Violations& violations);
bool CheckKnownEnum(const FieldPath& path, int value, const google::protobuf::EnumDescriptor* type,
                    Violations& violations);

// Three numbers, each of magnitude <= max; none after a violation.
std::optional<Eigen::Vector3d> CheckVector3(const FieldPath& path, const DoubleList& values,
                                            double max, std::string_view unit,
                                            Violations& violations);
// The same, or `fallback`: where there are no numbers, and after a violation.
Eigen::Vector3d CheckVector3Or(const Eigen::Vector3d& fallback, const FieldPath& path,
                               const DoubleList& values, double max, std::string_view unit,
                               Violations& violations);
// Data type one of `types`, shape [rows, columns], data of exactly that many bytes. The rows, or
// none after a violation.
std::optional<size_t> CheckPackedRows(const FieldPath& path, const v1::PackedArray& array,
                                      std::initializer_list<v1::PackedArray::DataType> types,
                                      uint32_t columns, Violations& violations);

}  // namespace drape::api
