// Vectors out of packed arrays that CheckPackedRows has checked.
#pragma once

#include <Eigen/Core>
#include <cstring>

#include "drape/v1/array.pb.h"

namespace drape::api {

template <class T>
Eigen::Vector3d PackedVectorOf(const v1::PackedArray& array, size_t row) {
  T xyz[3];
  std::memcpy(xyz, array.data().data() + row * sizeof(xyz), sizeof(xyz));
  return {double{xyz[0]}, double{xyz[1]}, double{xyz[2]}};
}

// Row `row` of an array [n, 3] of FLOAT32 or FLOAT64.
inline Eigen::Vector3d PackedVector(const v1::PackedArray& array, size_t row) {
  return array.data_type() == v1::PackedArray::FLOAT64 ? PackedVectorOf<double>(array, row)
                                                       : PackedVectorOf<float>(array, row);
}

}  // namespace drape::api
