#include "server/solver/cpu/step/strain_histogram.h"

#include <algorithm>
#include <cmath>

namespace drape::cpu {

void StrainHistogram::Add(double strain) {
  const uint32_t key = StrainKey(static_cast<float>(std::fabs(strain)));
  ++link_count_;
  ++links_by_bin_[std::clamp(key, kFirstStrainKey, kFirstStrainKey + kStrainBins - 1) -
                  kFirstStrainKey];
}

double StrainHistogram::Percentile(uint32_t percent) const {
  const uint64_t rank = (link_count_ * percent + 99) / 100;
  uint32_t bin = 0;
  for (uint64_t links = links_by_bin_[0]; links < rank;) links += links_by_bin_[++bin];
  return bin == 0 ? 0 : StrainOfKey(kFirstStrainKey + bin);
}

}  // namespace drape::cpu
