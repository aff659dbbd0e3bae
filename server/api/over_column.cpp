#include "server/api/over_column.h"

namespace drape::api {

bool CheckOverColumn(const FieldPath& path, const DoubleList& over_s, size_t rows,
                     Violations& violations) {
  return over_s.empty() ||
         violations.Length(path, static_cast<size_t>(over_s.size()), rows, "1 per row, or none");
}

double CheckOver(const FieldPath& path, const DoubleList& over_s, size_t row,
                 Violations& violations) {
  if (over_s.empty()) return 0;
  const double seconds = over_s[static_cast<int>(row)];
  violations.InRange(path.At(row), seconds, {0, kMaxMotion_s, "s"});
  return seconds;
}

}  // namespace drape::api
