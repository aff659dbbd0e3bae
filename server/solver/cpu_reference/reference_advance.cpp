#include "server/solver/cpu_reference/reference_stages.h"

namespace drape::reference {

using Eigen::Vector3d;

namespace {

// u = v + a h/2: p + h u is the ballistic position (Bender et al. 2009, section 3.1, eq. 2).
void PredictBallistic(StepContext& context) {
  context.base = context.state.positions_m;
  for (uint32_t i = 0; i < context.model.particle_count(); ++i) {
    context.u[i] = context.state.velocities_m_per_s[i] + context.a[i] * (context.h / 2);
  }
}

// The backward differentiation formula of second order, for positions and velocities alike.
// Damping is part of it, at the end of the substep. The first substep of a step, whose previous
// state is the present one, takes the mean of the velocities at its ends.
void PredictTwoStep(StepContext& context) {
  const double force_s = context.substep.kick_within_s;
  const double damping = 1 / (1 + context.parameters.damping_per_s * force_s);
  for (uint32_t i = 0; i < context.model.particle_count(); ++i) {
    const Vector3d& p = context.state.positions_m[i];
    const Vector3d& v = context.state.velocities_m_per_s[i];
    context.base[i] = p + (p - context.previous.positions_m[i]) / 3 + context.substep.lead_s * v;
    context.u[i] = v + (v - context.previous.velocities_m_per_s[i]) / 3 +
                   force_s * context.parameters.gravity_m_per_s2;
    context.u[i] *= damping;
  }
  context.previous = context.state;
}

// The share of its way of a pin, or of what a grip holds, as a velocity; b so that it ends there.
void PredictHeld(StepContext& context, const Grip& held) {
  const Substep& substep = context.substep;
  const uint32_t i = held.particle;
  const Vector3d& p = context.state.positions_m[i];
  const Vector3d way = (held.target_m - p) / substep.pin_shares;
  context.u[i] = way / substep.duration_s;
  context.base[i] = p;
  if (substep.is_two_step) context.base[i] += way - context.h * context.u[i];
}

}  // namespace

void Predict(StepContext& context) {
  if (context.substep.is_two_step) {
    PredictTwoStep(context);
  } else {
    PredictBallistic(context);
  }
  for (const Grip& held : context.held) PredictHeld(context, held);
}

// p = b + h u, and v = u + a h/2 (Bender et al. 2009, section 3.1, eq. 1 and 2) or, with two steps
// and for pins, the velocity itself.
void Integrate(StepContext& context) {
  ParticleState& state = context.state;
  for (uint32_t i = 0; i < context.model.particle_count(); ++i) {
    state.positions_m[i] = context.base[i] + context.h * context.u[i];
    state.velocities_m_per_s[i] = context.u[i];
    if (!context.substep.is_two_step) {
      state.velocities_m_per_s[i] += context.a[i] * (context.h / 2);
    }
  }
  for (const Grip& held : context.held) {
    state.velocities_m_per_s[held.particle] = context.u[held.particle];
  }
}

}  // namespace drape::reference
