// The inverse of shaders/lib/float_order.glsl.
#pragma once

#include <bit>
#include <cstdint>

namespace drape::render {

// The float with these OrderedBits.
inline float FloatFromOrderedBits(uint32_t bits) {
  constexpr uint32_t kSign = 0x80000000u;
  return std::bit_cast<float>((bits & kSign) != 0 ? bits ^ kSign : ~bits);
}

}  // namespace drape::render
