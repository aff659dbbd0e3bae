#include "server/solver/cpu/joints.h"

#include "server/solver/cpu/constraint_math.h"

namespace drape::cpu {

bool SolveJoints(const StepContext& context) {
  const FloatControls& controls = context.controls;
  const float h = controls.h;
  const float inverse_h = controls.inverse_h;
  const Lanes* const p = context.scratch.state.positions.data();
  Lanes* const u = context.scratch.state.velocities.data();
  bool changed = false;
  for (size_t k = 0; k < context.model.joints.size(); ++k) {
    const auto& [i, j, inverse_mass_i, inverse_mass_j, compliance] = context.model.joints[k];
    Lanes& lambda = context.scratch.joint_impulses[k];
    const float alpha_over_h = compliance * inverse_h;
    const Lanes residual = PredictedDifference(p[i], p[j], u[i], u[j], h) + alpha_over_h * lambda;
    if (controls.tolerance > 0 && !(Length(residual) > controls.contact_tolerance)) continue;
    const Lanes impulse = JointImpulse(
        residual, inverse_h, (inverse_mass_i + inverse_mass_j) + alpha_over_h * inverse_h);
    lambda += impulse;
    u[i] -= inverse_mass_i * impulse;
    u[j] += inverse_mass_j * impulse;
    changed = true;
  }
  return changed;
}

void SolveJointVelocities(const StepContext& context) {
  Lanes* const v = context.scratch.state.velocities.data();
  for (const auto& [i, j, inverse_mass_i, inverse_mass_j, compliance] : context.model.joints) {
    if (compliance > 0) continue;
    const Lanes impulse = (v[i] - v[j]) / (inverse_mass_i + inverse_mass_j);
    v[i] -= inverse_mass_i * impulse;
    v[j] += inverse_mass_j * impulse;
  }
}

Lanes JointResidual(const StepContext& context, const FloatState& state, size_t index) {
  const FloatJoint& joint = context.model.joints[index];
  const float alpha_over_h = joint.compliance * context.controls.inverse_h;
  return (state.positions[joint.j] - state.positions[joint.i]) +
         alpha_over_h * context.scratch.joint_impulses[index];
}

void AdvanceLengths(const StepContext& context) {
  const OwnLengths& lengths = *context.own_lengths;
  std::vector<Lanes>& now = context.scratch.rest_lengths;
  now = lengths.targets;
  const float substeps_left = context.substep.pin_shares - 1;
  if (substeps_left == 0) return;
  const float substeps = static_cast<float>(context.controls.schedule.size());
  const float share = (substeps - substeps_left) / substeps;
  context.ForRanges(now.size(), kGroupGrain, [&](size_t begin, size_t end) {
    for (size_t g = begin; g < end; ++g) {
      now[g] = LengthBetween(lengths.starts[g], lengths.targets[g], share);
    }
  });
}

std::vector<Lanes> PackLengths(const FloatModel& model, std::span<const double> rest_lengths_m) {
  std::vector<Lanes> packed(model.groups.size(), Splat(0));
  for (size_t c = 0; c < rest_lengths_m.size(); ++c) {
    const uint32_t place = model.constraint_places[c];
    packed[place / kLaneCount][place % kLaneCount] = static_cast<float>(rest_lengths_m[c]);
  }
  return packed;
}

double RestLengthAtEnd(const StepContext& context, size_t c) {
  if (context.own_lengths == nullptr) return context.model.source->constraints()[c].rest_length_m;
  const uint32_t place = context.model.constraint_places[c];
  return context.own_lengths->targets[place / kLaneCount][place % kLaneCount];
}

}  // namespace drape::cpu
