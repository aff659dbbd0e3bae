#include "server/solver/hinge_stages.h"

#include <cmath>

#include "server/solver/solver_constants.h"

namespace drape {
namespace {

// The polynomial R(x) = T_k(w_0 - w_1 x) / T_k(w_0), of which T_k(w_0) = 1 / kHingeResidual and
// R'(0) = -1: what k stages leave of a deflection whose s omega^2 is x. T_j(w_0) = cosh(j a / k).
double Argument() {
  return std::acosh(1 / kHingeResidual);  // a
}

// w_1 = T_k(w_0) / T_k'(w_0)
double Slope(uint32_t count) {
  const double a = Argument();
  return std::sinh(a / count) / (kHingeResidual * count * std::sinh(a));
}

}  // namespace

double LargestHingeRatio(uint32_t count) {
  return (std::cosh(Argument() / count) + 1) / Slope(count);
}

uint32_t HingeStageCount(double ratio) {
  uint32_t count = 1;
  while (count < kMaxHingeStages && LargestHingeRatio(count) < ratio) ++count;
  return count;
}

std::vector<HingeStage> HingeStages(uint32_t count) {
  if (count == 0) return {};
  const auto chebyshev = [&](uint32_t j) { return std::cosh(j * Argument() / count); };
  const double slope = Slope(count);
  std::vector<HingeStage> stages = {{.momentum = 0, .gain = slope / chebyshev(1)}};
  for (uint32_t j = 2; j <= count; ++j) {
    stages.push_back({.momentum = chebyshev(j - 2) / chebyshev(j),
                      .gain = 2 * slope * chebyshev(j - 1) / chebyshev(j)});
  }
  return stages;
}

}  // namespace drape
