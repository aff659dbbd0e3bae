// Single precision, for formats without double precision.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "drape/states.h"

namespace drape::cli {

// The nearest float; the largest one for values beyond (a plain cast would be undefined).
inline float ToFloat32(double value) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(value, -kLargest, kLargest));
}

// Appends all elements of `vectors`.
inline void AppendFloat32(const VectorView& vectors, std::vector<float>* elements) {
  elements->insert(elements->end(), vectors.floats().begin(), vectors.floats().end());
  for (const double element : vectors.doubles()) elements->push_back(ToFloat32(element));
}

}  // namespace drape::cli
