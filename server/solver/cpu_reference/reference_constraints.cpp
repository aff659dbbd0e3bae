#include "server/solver/cpu_reference/reference_constraints.h"

#include <algorithm>

namespace drape {

double ClampImpulse(ConstraintKind kind, double lambda, double impulse) {
  switch (kind) {
    case ConstraintKind::kAtMost:
      return std::min(lambda + impulse, 0.0) - lambda;
    case ConstraintKind::kAtLeast:
      return std::max(lambda + impulse, 0.0) - lambda;
    case ConstraintKind::kEqual:
      break;
  }
  return impulse;
}

double Violation(ConstraintKind kind, double error_m) {
  if (kind == ConstraintKind::kAtMost) return std::max(error_m, 0.0);
  if (kind == ConstraintKind::kAtLeast) return std::min(error_m, 0.0);
  return error_m;
}

void ReferenceLengths::Advance(uint32_t substep, uint32_t substeps) {
  if (targets_m_.empty()) return;
  lengths_m_.assign(targets_m_.begin(), targets_m_.end());
  if (substep + 1 == substeps) return;
  const double share = static_cast<double>(substep + 1) / substeps;
  for (size_t k = 0; k < lengths_m_.size(); ++k) {
    lengths_m_[k] = starts_m_[k] + (targets_m_[k] - starts_m_[k]) * share;
  }
}

}  // namespace drape
