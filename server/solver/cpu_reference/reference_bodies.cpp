#include <algorithm>

#include "server/solver/cpu_reference/reference_stages.h"

namespace drape::reference {

using Eigen::Vector3d;

void BeginBodies(StepContext& context, double begin_s) {
  context.bodies.Begin(begin_s, context.substep.duration_s);
}

void PredictBodies(StepContext& context) {
  Bodies& bodies = context.bodies;
  if (!bodies.HasRebounds()) return;
  for (size_t k = 0; k < bodies.size(); ++k) {
    for (uint32_t i = 0; i < context.model.particle_count(); ++i) {
      bodies.Predict(k, context.Particle(i, context.state.positions_m[i]),
                     context.state.velocities_m_per_s[i]);
    }
  }
}

// Body by body, particle by particle. What is held gives way to nothing, so it comes last.
bool SolveBodies(StepContext& context) {
  Bodies& bodies = context.bodies;
  double change = 0;
  for (size_t k = 0; k < bodies.size(); ++k) {
    const auto solve = [&](uint32_t i) {
      change =
          std::max(change, bodies.Solve(k, context.Particle(i, context.base[i]), context.u[i]));
      context.Pull(i, bodies.LastImpulse(k));
    };
    for (uint32_t i = 0; i < context.model.particle_count(); ++i) {
      if (context.w[i] != 0) solve(i);
    }
    for (const Grip& held : context.held) solve(held.particle);
  }
  change = std::max(change, bodies.SolveColliders());
  const double tolerance = context.plan.tolerance;
  return !bodies.empty() &&
         (tolerance == 0 || context.h * change > tolerance * context.model.length_scale_m());
}

void IntegrateBodies(StepContext& context) {
  context.bodies.End();
}

void CorrectBodies(StepContext& context) {
  Bodies& bodies = context.bodies;
  ParticleState& state = context.state;
  for (size_t k = 0; k < bodies.size(); ++k) {
    for (const uint32_t i : bodies.PushedBy(k)) {
      bodies.Correct(k, context.Particle(i, context.base[i]), state.positions_m[i],
                     state.velocities_m_per_s[i]);
      context.Pull(i, bodies.LastImpulse(k));
    }
  }
  bodies.CorrectColliders();
}

}  // namespace drape::reference
