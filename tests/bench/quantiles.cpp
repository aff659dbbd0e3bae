#include "tests/bench/quantiles.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/core/check.h"

namespace drape::bench {

double Quantile(std::span<const double> values, double q) {
  DRAPE_CHECK(!values.empty(), "a quantile of nothing");
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const double position = q * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<size_t>(std::floor(position));
  const size_t above = std::min(below + 1, sorted.size() - 1);
  const double share = position - static_cast<double>(below);
  return sorted[below] + share * (sorted[above] - sorted[below]);
}

}  // namespace drape::bench
