#include "server/solver/cpu/alone/joints.h"

#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/formulas/constraint_math.h"

namespace drape::cpu {

using namespace HWY_NAMESPACE;  // constraint_math-inl.h; nothing here depends on what it is

namespace {

// With the inverse masses of what is held.
FloatJoint HeldJoint(const StepContext& context, size_t index) {
  FloatJoint joint = context.model.joints[index];
  joint.inverse_mass_i = context.held.inverse_masses[joint.i];
  joint.inverse_mass_j = context.held.inverse_masses[joint.j];
  return joint;
}

// What a joint does to those of its particles that are held.
void PullHeld(const StepContext& context, uint32_t i, uint32_t j, Vec4 impulse) {
  ImpulseSums* const sums = context.impulses();
  if (sums == nullptr) return;
  if (!context.held.IsFree(i)) sums->Pull(i, -impulse);
  if (!context.held.IsFree(j)) sums->Pull(j, impulse);
}

}  // namespace

bool SolveJoints(const StepContext& context) {
  const FloatControls& controls = context.controls;
  const float h = controls.h;
  const float inverse_h = controls.inverse_h;
  const Vec4* const p = context.scratch.state.positions.data();
  Vec4* const u = context.scratch.state.velocities.data();
  bool changed = false;
  for (size_t k = 0; k < context.model.joints.size(); ++k) {
    const auto [i, j, inverse_mass_i, inverse_mass_j, compliance] = HeldJoint(context, k);
    if (context.held.AreHeld(i, j)) continue;
    Vec4& lambda = context.scratch.joint_impulses[k];
    const float alpha_over_h = compliance * inverse_h;
    const Vec4 residual = PredictedDifference(p[i], p[j], u[i], u[j], h) + alpha_over_h * lambda;
    if (controls.tolerance > 0 && !(Length(residual) > controls.contact_tolerance)) continue;
    const Vec4 impulse = JointImpulse(residual, inverse_h,
                                      (inverse_mass_i + inverse_mass_j) + alpha_over_h * inverse_h);
    lambda += impulse;
    u[i] -= inverse_mass_i * impulse;
    u[j] += inverse_mass_j * impulse;
    PullHeld(context, i, j, impulse);
    changed = true;
  }
  return changed;
}

void SolveJointVelocities(const StepContext& context) {
  Vec4* const v = context.scratch.state.velocities.data();
  for (size_t k = 0; k < context.model.joints.size(); ++k) {
    const auto [i, j, inverse_mass_i, inverse_mass_j, compliance] = HeldJoint(context, k);
    if (compliance > 0 || context.held.AreHeld(i, j)) continue;
    const Vec4 impulse = (v[i] - v[j]) / (inverse_mass_i + inverse_mass_j);
    v[i] -= inverse_mass_i * impulse;
    v[j] += inverse_mass_j * impulse;
    PullHeld(context, i, j, impulse);
  }
}

}  // namespace drape::cpu
