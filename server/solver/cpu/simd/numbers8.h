// Eight floats as they lie in memory, for code that knows no instruction set.
#pragma once

#include <array>
#include <cstdint>

#include "server/solver/cpu/simd/vec4.h"

namespace drape::cpu {

// Eight strips of one cloth, and a number of each.
inline constexpr uint32_t kVec8Size = 2 * kVec4Size;
struct alignas(32) Numbers8 {
  std::array<float, kVec8Size> values;

  void Set(uint32_t strip, float value) { values[strip] = value; }
};

}  // namespace drape::cpu
