#include "server/scheduler/cost_estimate.h"

#include <algorithm>

namespace drape {
namespace {

// How much of the former batches is kept with every batch [-].
constexpr double kRateMemory = 0.98;

// Weight of a new measurement in the smoothed one [-]. A step that became costly counts quickly,
// one that was quick for once slowly.
constexpr double kCostShareOfRise = 0.5;
constexpr double kCostShareOfFall = 0.2;

}  // namespace

void SolveRate::Measured(double solves, double cost_us) {
  solves_ = kRateMemory * solves_ + solves;
  cost_us_ = kRateMemory * cost_us_ + std::max(cost_us, 1.0);
}

double CostEstimate::Expected_us(double solves, bool has_tolerance, const SolveRate& rate) const {
  const double most_us = (solves + kSolvesPerClothStep) * rate.us_per_solve();
  if (measured_us_ == 0) return has_tolerance ? kLeastShareOfCost * most_us : most_us;
  return std::max(measured_us_, kLeastShareOfCost * most_us);
}

void CostEstimate::Measured(double cost_us) {
  const double measured_us = std::max(cost_us, 1e-3);
  const double share = measured_us > measured_us_ ? kCostShareOfRise : kCostShareOfFall;
  measured_us_ =
      measured_us_ == 0 ? measured_us : measured_us_ + share * (measured_us - measured_us_);
}

}  // namespace drape
