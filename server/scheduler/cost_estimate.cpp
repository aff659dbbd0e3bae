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

// A step that was left undone is expected to take so many times what it had taken [-]: sooner or
// later it counts as long, and is done in pieces.
constexpr double kUndoneGrowth = 2;

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

void CostEstimate::LeftUndone(double cost_us) {
  measured_us_ = std::max(measured_us_, kUndoneGrowth * cost_us);
}

DoneWork ShareCost(std::span<const ClothCost> cloths, double cost_us) {
  if (cloths.empty()) return {0, 0};
  double solves = 0, done_us = 0, thread_us = 0;
  bool are_timed = true;
  for (const ClothCost& cloth : cloths) {
    thread_us += cloth.thread_us;
    if (cloth.is_undone) continue;
    are_timed &= cloth.thread_us > 0;
    solves += cloth.solves + kSolvesPerClothStep;
    done_us += cloth.thread_us;
  }
  for (const ClothCost& cloth : cloths) {
    if (cloth.is_undone) {
      cloth.estimate->LeftUndone(cloth.thread_us);
    } else if (are_timed) {
      cloth.estimate->Measured(cost_us * cloth.thread_us / thread_us);
    } else {
      cloth.estimate->Measured(cost_us * (cloth.solves + kSolvesPerClothStep) / solves);
    }
  }
  return {solves, are_timed && thread_us > 0 ? cost_us * done_us / thread_us : cost_us};
}

}  // namespace drape
