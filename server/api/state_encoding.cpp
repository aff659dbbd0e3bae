#include "server/api/state_encoding.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>

namespace drape::api {
namespace {

using Eigen::Vector3d;

constexpr size_t kEncodedBytes = 2;
constexpr double kLargestNumber = 32767;  // the same on both sides of the middle

// `number_of(row vector)` gives three 16-bit numbers.
template <class NumbersOf>
void AppendRows(const ScalarColumn& column, size_t first_row, size_t row_count, std::string* data,
                NumbersOf numbers_of) {
  const size_t begin = data->size();
  data->resize(begin + row_count * 3 * kEncodedBytes);
  char* to = data->data() + begin;
  for (size_t k = 0; k < row_count; ++k, to += 3 * kEncodedBytes) {
    const auto numbers = numbers_of(VectorAt(column, first_row + k));
    static_assert(sizeof(numbers) == 3 * kEncodedBytes);
    std::memcpy(to, numbers.data(), sizeof(numbers));
  }
}

}  // namespace

size_t EncodedBytes(v1::StateView::Encoding encoding, ScalarType scalar) {
  if (encoding != v1::StateView::ENCODING_UNSPECIFIED) return kEncodedBytes;
  return scalar == ScalarType::kFloat64 ? sizeof(double) : sizeof(float);
}

size_t EncodedBytes(v1::StateView::Encoding encoding, const ScalarColumn& column) {
  return EncodedBytes(encoding, std::holds_alternative<std::vector<double>>(column)
                                    ? ScalarType::kFloat64
                                    : ScalarType::kFloat32);
}

FixedGrid FixedGridOf(const ScalarColumn& positions_m, size_t first_row, size_t row_count) {
  if (row_count == 0) return {};
  Eigen::AlignedBox3d box;
  for (size_t k = 0; k < row_count; ++k) box.extend(VectorAt(positions_m, first_row + k));
  return {box.center(), box.sizes().maxCoeff() / (2 * kLargestNumber)};
}

void AppendFloat16(const ScalarColumn& column, size_t first_row, size_t row_count,
                   const Vector3d& shift, std::string* data) {
  AppendRows(column, first_row, row_count, data, [&](const Vector3d& row) {
    return Eigen::Matrix<Eigen::half, 3, 1>((row + shift).cast<float>().cast<Eigen::half>());
  });
}

void AppendFixed16(const ScalarColumn& positions_m, size_t first_row, size_t row_count,
                   const FixedGrid& grid, std::string* data) {
  const double step_m = grid.step_m > 0 ? grid.step_m : 1;
  AppendRows(positions_m, first_row, row_count, data, [&](const Vector3d& row) {
    const Vector3d numbers = (row - grid.middle_m) / step_m;
    return Eigen::Matrix<int16_t, 3, 1>(numbers.array().rint().cast<int16_t>());
  });
}

}  // namespace drape::api
