#include "server/api/sent_column.h"

#include <span>
#include <utility>
#include <variant>

namespace drape::api {

SentColumn::SentColumn(ScalarColumn numbers)
    : numbers_(std::make_shared<ScalarColumn>(std::move(numbers))) {
  std::visit(
      [&](const auto& values) {
        row_count_ = values.size() / 3;
        row_bytes_ = 3 * sizeof(values[0]);
        if (!values.empty()) bytes_ = SliceOf(numbers_, std::as_bytes(std::span(values)));
      },
      *numbers_);
}

void SentColumn::Shift(uint64_t first_row, uint64_t row_count, const Eigen::Vector3d& shift) {
  if (shift.isZero(0)) return;
  std::visit(
      [&](auto& values) {
        using T = typename std::decay_t<decltype(values)>::value_type;
        const double x = shift.x(), y = shift.y(), z = shift.z();
        T* xyz = values.data() + 3 * first_row;
        for (const T* const end = xyz + 3 * row_count; xyz != end; xyz += 3) {
          xyz[0] = static_cast<T>(double{xyz[0]} + x);
          xyz[1] = static_cast<T>(double{xyz[1]} + y);
          xyz[2] = static_cast<T>(double{xyz[2]} + z);
        }
      },
      *numbers_);
}

grpc::Slice SentColumn::Rows(uint64_t first_row, uint64_t row_count) const {
  return bytes_.sub(first_row * row_bytes_, (first_row + row_count) * row_bytes_);
}

}  // namespace drape::api
