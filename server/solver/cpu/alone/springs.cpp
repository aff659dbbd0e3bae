#include "server/solver/cpu/alone/springs.h"

#include "server/solver/cpu/formulas/constraint_math-inl.h"

namespace drape::cpu {
namespace {

using namespace HWY_NAMESPACE;  // constraint_math-inl.h; nothing here depends on what it is

// By the springs of particle i [N].
Vec4 SpringForceOn(const FloatModel& model, const Vec4* p, const Vec4* v, uint32_t i) {
  Vec4 force{};
  for (uint32_t e = model.spring_offsets[i]; e < model.spring_offsets[i + 1]; ++e) {
    const FloatSpringEnd& end = model.spring_ends[e];
    const uint32_t j = end.other_particle;
    force += SpringForce(p[j] - p[i], v[j] - v[i], end.rest_length, end.stiffness, end.damping);
  }
  return force;
}

// A_i(p, v) by the springs of particle i.
Vec4 SpringAcceleration(const FloatModel& model, const Vec4* p, const Vec4* v, uint32_t i) {
  return model.inverse_masses[i] * SpringForceOn(model, p, v, i);
}

void PullBySprings(const StepContext& context, const Vec4* p, const Vec4* v, float duration) {
  context.ForHeldAsked([&](uint32_t i, ImpulseSums& sums) {
    sums.Pull(i, duration * SpringForceOn(context.model, p, v, i));
  });
}

}  // namespace

void ApplySprings(const StepContext& context, const Vec4* positions, float duration) {
  if (!context.controls.Has(StepStage::kApplySprings)) return;
  const FloatModel& model = context.model;
  StepScratch& scratch = context.scratch;
  Vec4* const v = scratch.state.velocities.data();
  PullBySprings(context, positions, v, duration);
  context.ForFreeParticles(
      [&](uint32_t i) { scratch.accelerations[i] = SpringAcceleration(model, positions, v, i); });
  context.ForFreeParticles([&](uint32_t i) { v[i] += duration * scratch.accelerations[i]; });
}

void AccelerateBySprings(const StepContext& context) {
  if (!context.controls.plan.solver.has_spring_forces || context.substep.is_two_step) return;
  StepScratch& scratch = context.scratch;
  const Vec4* const p = scratch.state.positions.data();
  const Vec4* const v = scratch.state.velocities.data();
  const Vec4 gravity = context.controls.gravity;
  PullBySprings(context, p, v, context.substep.interval);
  context.ForFreeParticles([&](uint32_t i) {
    scratch.accelerations[i] = gravity + SpringAcceleration(context.model, p, v, i);
  });
}

}  // namespace drape::cpu
