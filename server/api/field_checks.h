// Checks of forms that only messages have: lists of numbers, enums, packed arrays.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/repeated_field.h>

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

#include "drape/v1/array.pb.h"
#include "server/core/violations.h"

namespace drape::api {

// Every plausible length, mass and coefficient in SI units is within these bounds. Within them
// single precision neither overflows nor loses a reciprocal.
inline constexpr double kMaxMagnitude = 1e12;
inline constexpr double kMinPositive = 1e-12;

using DoubleList = google::protobuf::RepeatedField<double>;

// Requires |value| <= max of every value.
bool CheckAllWithin(const FieldPath& path, const DoubleList& values, double max,
                    std::string_view unit, Violations& violations);
bool CheckKnownEnum(const FieldPath& path, int value, const google::protobuf::EnumDescriptor* type,
                    Violations& violations);

// Three numbers, each of magnitude <= max; none after a violation.
std::optional<Eigen::Vector3d> CheckVector3(const FieldPath& path, const DoubleList& values,
                                            double max, std::string_view unit,
                                            Violations& violations);
// The same; returns `fallback` if there are no numbers or after a violation.
Eigen::Vector3d CheckVector3Or(const Eigen::Vector3d& fallback, const FieldPath& path,
                               const DoubleList& values, double max, std::string_view unit,
                               Violations& violations);
// The name of a world, at most kMaxWorldNameBytes; may be empty.
std::string CheckWorldName(const FieldPath& path, const std::string& name, Violations& violations);

// Requires one of the data types `types`, the shape [rows, columns], and exactly as many bytes of
// data. Returns the rows, or none after a violation.
std::optional<size_t> CheckPackedRows(const FieldPath& path, const v1::PackedArray& array,
                                      std::initializer_list<v1::PackedArray::DataType> types,
                                      uint32_t columns, Violations& violations);

}  // namespace drape::api
