#include <algorithm>
#include <cmath>

#include "server/solver/cpu_reference/reference_directions.h"
#include "server/solver/cpu_reference/reference_stages.h"
#include "server/solver/solver_constants.h"

namespace drape::reference {

namespace {

// Links that end the substep farther from their rest length than the refinement allows, and all at
// their ends: indices of constraints in order of the colours. The rest lengths are the model's.
std::vector<uint32_t> LinksToRefine(const StepContext& context) {
  const SceneModel& model = context.model;
  const double limit = std::max(context.plan.solver.refine_above_strain, context.plan.tolerance);
  std::vector<bool> is_at_stretched(model.particle_count(), false);
  for (const auto& [i, j, rest_length_m, compliance, kind] : model.constraints()) {
    if (context.IsHeld(i, j)) continue;
    const double length = context.PredictedDifference(i, j).norm();
    if (!(std::abs(length - rest_length_m) > limit * rest_length_m)) continue;
    is_at_stretched[i] = is_at_stretched[j] = true;
  }
  std::vector<uint32_t> links;
  for (uint32_t index = 0; index < model.constraint_count(); ++index) {
    const DistanceConstraint& constraint = model.constraints()[index];
    if (is_at_stretched[constraint.i] || is_at_stretched[constraint.j]) links.push_back(index);
  }
  return links;
}

// Moves the ends of a link, b, so that at the end of the substep, at b + h u, it has its length.
void MoveEnds(StepContext& context, uint32_t index) {
  const auto& [i, j, rest_length_m, compliance, kind] = context.model.constraints()[index];
  if (context.IsHeld(i, j)) return;
  const Eigen::Vector3d d = context.PredictedDifference(i, j);
  const Eigen::Vector3d n = DirectionOf(d);
  const double move = (d.norm() - rest_length_m) / (context.w[i] + context.w[j]);
  context.base[i] += context.w[i] * move * n;
  context.base[j] -= context.w[j] * move * n;
}

}  // namespace

void Refine(StepContext& context) {
  const SolverChoice& solver = context.plan.solver;
  for (uint32_t round = 0, solves = 0; round < solver.refine_rounds; ++round) {
    const auto links = LinksToRefine(context);
    for (unsigned sweep = 0; sweep < kRefineSweeps; ++sweep) {
      for (const uint32_t index : links) MoveEnds(context, index);
    }
    solves += kRefineSweeps * static_cast<uint32_t>(links.size());
    if (links.empty() || solves >= solver.refine_solves) return;
  }
}

}  // namespace drape::reference
