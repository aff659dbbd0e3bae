#include "server/solver/cpu_reference/reference_stages.h"

namespace drape::reference {

using Eigen::Vector3d;

Vector3d JointError(const StepContext& context, uint32_t index) {
  const auto [i, j, compliance] = context.model.joints()[index];
  return context.PredictedDifference(i, j) + compliance / context.h * context.joint_lambda[index];
}

// The impulse of every joint, in order of their colours: three equality constraints along the axes
// at once, which are independent and linear, so one impulse removes the error of one joint exactly
// (Bender et al. 2009, section 3.2).
bool SolveJoints(StepContext& context) {
  const double h = context.h, tolerance = context.plan.tolerance;
  bool has_changed = false;
  for (uint32_t index = 0; index < context.model.joint_count(); ++index) {
    const auto [i, j, compliance] = context.model.joints()[index];
    if (context.IsHeld(i, j)) continue;
    const Vector3d error = JointError(context, index);
    if (tolerance > 0 && !(error.norm() > tolerance * context.model.length_scale_m())) continue;

    const Vector3d impulse = -error / h / (context.w[i] + context.w[j] + compliance / (h * h));
    context.joint_lambda[index] += impulse;
    context.u[i] -= context.w[i] * impulse;
    context.u[j] += context.w[j] * impulse;
    context.Pull(i, -impulse);
    context.Pull(j, impulse);
    has_changed = true;
  }
  return has_changed;
}

// Velocity constraints v_j - v_i = 0 of rigid joints, after the advance.
void SolveJointVelocities(StepContext& context) {
  std::vector<Vector3d>& v = context.state.velocities_m_per_s;
  for (const auto& [i, j, compliance] : context.model.joints()) {
    if (compliance > 0 || context.IsHeld(i, j)) continue;
    const Vector3d impulse = -(v[j] - v[i]) / (context.w[i] + context.w[j]);
    v[i] -= context.w[i] * impulse;
    v[j] += context.w[j] * impulse;
    context.Pull(i, -impulse);
    context.Pull(j, impulse);
  }
}

}  // namespace drape::reference
