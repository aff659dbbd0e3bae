// The bins in which the backends in single precision count links by their strain, to find its
// percentiles: one for each number of kPercentileBits significant bits. Counts do not depend on any
// order.
#pragma once

#include <bit>
#include <cstdint>

#include "server/solver/solver_constants.h"

namespace drape {

// Bits of a float that are beyond kPercentileBits significant ones.
inline constexpr uint32_t kStrainKeyShift = 24 - kPercentileBits;

constexpr uint32_t StrainKey(float strain) {
  return std::bit_cast<uint32_t>(strain) >> kStrainKeyShift;
}
constexpr float StrainOfKey(uint32_t key) {
  return std::bit_cast<float>(key << kStrainKeyShift);
}

// Bin 0 has the strains below kMinPercentile, the last those of at least kMaxPercentile.
inline constexpr uint32_t kFirstStrainKey = StrainKey(static_cast<float>(kMinPercentile)) - 1;
inline constexpr uint32_t kStrainBins =
    StrainKey(static_cast<float>(kMaxPercentile)) - kFirstStrainKey + 1;

}  // namespace drape
