// Counts of links by their strain, and its percentiles.
#pragma once

#include <array>
#include <cstdint>

#include "server/solver/strain_bins.h"

namespace drape::cpu {

class StrainHistogram {
 public:
  // |strain| counts.
  void Add(double strain);
  // Nearest rank: the smallest strain that at least `percent` percent of the links do not exceed,
  // rounded down to kPercentileBits. 0 without links. `percent` in [1, 100].
  double Percentile(uint32_t percent) const;

 private:
  uint64_t link_count_ = 0;
  std::array<uint32_t, kStrainBins> links_by_bin_ = {};
};

}  // namespace drape::cpu
