// Columns of 16-bit numbers in place of what the backend computes. Pure.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>

#include "drape/v1/state.pb.h"
#include "server/solver/backend.h"

namespace drape::api {

// Bytes of one number of a column.
size_t EncodedBytes(v1::StateView::Encoding encoding, const ScalarColumn& column);
size_t EncodedBytes(v1::StateView::Encoding encoding, ScalarType scalar);

// How the positions of one cloth become INT16: (position - middle) / step, rounded.
struct FixedGrid {
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  // in the cloth frame
  double step_m = 0;                                   // 0: all positions are the middle
};
// The finest one that reaches the rows [first_row, first_row + row_count).
FixedGrid FixedGridOf(const ScalarColumn& positions_m, size_t first_row, size_t row_count);

// Append little-endian numbers: float16 of row + shift, rounded to nearest; INT16 on the grid.
void AppendFloat16(const ScalarColumn& column, size_t first_row, size_t row_count,
                   const Eigen::Vector3d& shift, std::string* data);
void AppendFixed16(const ScalarColumn& positions_m, size_t first_row, size_t row_count,
                   const FixedGrid& grid, std::string* data);

}  // namespace drape::api
