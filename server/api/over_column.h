// The column over_s of a table of controls: how long each row's motion takes. Pure.
#pragma once

#include "server/api/field_checks.h"

namespace drape::api {

// Longest motion of a pin, a collider or a rest length: over 30 years.
inline constexpr double kMaxMotion_s = 1e9;

// Empty, or one number per row.
bool CheckOverColumn(const FieldPath& path, const DoubleList& over_s, size_t rows,
                     Violations& violations);

// The number of a row in a column that passed CheckOverColumn; 0 if the column is empty.
double CheckOver(const FieldPath& path, const DoubleList& over_s, size_t row,
                 Violations& violations);

}  // namespace drape::api
