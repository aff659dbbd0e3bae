#include <cmath>

#include "server/solver/cpu_reference/reference_directions.h"
#include "server/solver/cpu_reference/reference_stages.h"

namespace drape::reference {

using Eigen::Vector3d;

namespace {

// Returns whether there was anything to solve.
bool SolveConstraint(StepContext& context, uint32_t index) {
  const auto [i, j, model_length, compliance, kind] = context.model.constraints()[index];
  if (context.IsHeld(i, j)) return false;
  const double h = context.h, tolerance = context.plan.tolerance;
  const Vector3d d = context.PredictedDifference(i, j);
  const double error = DistanceError(context, index, d.norm());
  if (tolerance > 0 && !(std::abs(error) > tolerance * context.rest_lengths[index])) return false;

  const auto [n, slope] =
      BlendDirections(context.base[j] - context.base[i], d, context.plan.solver.end_share);
  const double impulse =
      ClampImpulse(kind, context.lambda[index],
                   -error / h / ((context.w[i] + context.w[j]) * slope + compliance / (h * h)));
  if (kind != ConstraintKind::kEqual && impulse == 0) return false;  // slack
  context.lambda[index] += impulse;
  context.u[i] -= context.w[i] * impulse * n;
  context.u[j] += context.w[j] * impulse * n;
  context.Pull(i, -impulse * n);
  context.Pull(j, impulse * n);
  return true;
}

}  // namespace

double DistanceError(const StepContext& context, uint32_t index, double length) {
  const DistanceConstraint& constraint = context.model.constraints()[index];
  return length - context.rest_lengths[index] +
         constraint.compliance_m_per_n / context.h * context.lambda[index];
}

// The impulse of every constraint, in order of the colours (Bender et al. 2009, section 3.2; the
// accumulated lambda makes the elongation of compliant constraints independent of the sweeps).
bool SolveDistance(StepContext& context, uint32_t begin, uint32_t end) {
  if (!context.plan.Has(StepStage::kSolveDistance)) return false;
  bool has_changed = false;
  for (uint32_t index = begin; index < end; ++index) {
    has_changed |= SolveConstraint(context, index);
  }
  return has_changed;
}

// Velocity constraints n . (v_j - v_i) = 0 of rigid links, after the advance (Bender et al. 2009,
// section 3.2; with the direction at the start: RATTLE). Compliant links, ropes and
// struts have none.
void SolveDistanceVelocities(StepContext& context, uint32_t begin, uint32_t end) {
  const std::vector<Vector3d>& p = context.state.positions_m;
  std::vector<Vector3d>& v = context.state.velocities_m_per_s;
  for (const auto& [i, j, length, compliance, kind] :
       context.model.constraints().subspan(begin, end - begin)) {
    if (compliance > 0 || kind != ConstraintKind::kEqual || context.IsHeld(i, j)) continue;
    const Vector3d n = DirectionOf(p[j] - p[i]);
    const double impulse = -n.dot(v[j] - v[i]) / (context.w[i] + context.w[j]);
    v[i] -= context.w[i] * impulse * n;
    v[j] += context.w[j] * impulse * n;
    context.Pull(i, -impulse * n);
    context.Pull(j, impulse * n);
  }
}

}  // namespace drape::reference
