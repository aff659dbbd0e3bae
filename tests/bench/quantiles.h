// Order statistics of a few measured values.
#pragma once

#include <span>

namespace drape::bench {

// The q-quantile, q in [0, 1], linear between the neighbouring values; q = 0.5 is the median.
// `values` must not be empty; any order.
double Quantile(std::span<const double> values, double q);

}  // namespace drape::bench
