#include "server/solver/cpu_reference/reference_springs.h"

#include <algorithm>

#include "server/solver/cpu_reference/reference_stages.h"
#include "server/solver/solver_constants.h"

namespace drape {

namespace {

std::span<const SpringEnd> SpringsOf(const SceneModel& model, uint32_t i) {
  const uint32_t begin = model.spring_offsets()[i];
  return model.spring_ends().subspan(begin, model.spring_offsets()[i + 1] - begin);
}

// By one of them.
Eigen::Vector3d SpringForce(const SpringEnd& spring, uint32_t i, const ParticleState& state) {
  const uint32_t j = spring.other_particle;
  const Eigen::Vector3d d = state.positions_m[j] - state.positions_m[i];
  const double length = d.norm();
  if (length < kMinDirectionLength_m) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d direction = d / length;
  const double speed = (state.velocities_m_per_s[j] - state.velocities_m_per_s[i]).dot(direction);
  return direction * (spring.stiffness_n_per_m * (length - spring.rest_length_m) +
                      spring.damping_n_s_per_m * speed);
}

}  // namespace

Eigen::Vector3d SpringForceOn(const SceneModel& model, const ParticleState& state, uint32_t i) {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (const SpringEnd& spring : SpringsOf(model, i)) force += SpringForce(spring, i, state);
  return force;
}

std::vector<Eigen::Vector3d> SpringAccelerations(const SceneModel& model,
                                                 const ParticleState& state) {
  std::vector<Eigen::Vector3d> accelerations;
  accelerations.reserve(model.particle_count());
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    accelerations.push_back(model.inverse_masses_per_kg()[i] * SpringForceOn(model, state, i));
  }
  return accelerations;
}

}  // namespace drape

namespace drape::reference {
namespace {

void PullBySprings(const StepContext& context, const ParticleState& state, double duration_s) {
  if (context.impulses == nullptr) return;
  for (const Grip& held : context.held) {
    const uint32_t i = held.particle;
    context.Pull(i, duration_s * SpringForceOn(context.model, state, i));
  }
}

}  // namespace

void ApplySprings(const StepContext& context, double duration_s,
                  const std::vector<Eigen::Vector3d>& positions,
                  std::vector<Eigen::Vector3d>& velocities) {
  if (!context.plan.Has(StepStage::kApplySprings)) return;
  const ParticleState state{positions, velocities};
  PullBySprings(context, state, duration_s);
  const auto accelerations = SpringAccelerations(context.model, state);
  context.Add(accelerations, duration_s, velocities);
}

void AccelerateBySprings(StepContext& context) {
  if (context.substep.is_two_step) return;
  std::fill(context.a.begin(), context.a.end(), context.parameters.gravity_m_per_s2);
  if (!context.plan.solver.has_spring_forces) return;
  PullBySprings(context, context.state, context.h);
  const auto accelerations = SpringAccelerations(context.model, context.state);
  for (uint32_t i = 0; i < context.model.particle_count(); ++i) context.a[i] += accelerations[i];
}

}  // namespace drape::reference
