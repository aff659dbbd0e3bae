#include <algorithm>
#include <vector>

#include "server/solver/bodies/pressed_particles.h"
#include "server/solver/cpu_reference/reference_stages.h"

namespace drape::reference {

using Eigen::Vector3d;

namespace {

// What `pressed_particles.h` asks for; with mean velocities while sweeps last, then with those at
// the end.
class PressedCloth {
 public:
  PressedCloth(StepContext& context, std::vector<Vector3d>& velocities)
      : context_(context), velocities_(velocities) {
    for (size_t c = 0; c < context.colliders.size(); ++c) {
      if (!context.colliders.IsBody(c)) has_colliders_ = true;
    }
  }

  bodies::Particle ParticleOf(uint32_t i) const { return context_.Particle(i, context_.base[i]); }
  const Vector3d& Velocity(uint32_t i) const { return velocities_[i]; }
  void SetVelocity(uint32_t i, const Vector3d& u) { velocities_[i] = u; }
  bool HasColliders() const { return has_colliders_; }
  void Settle(uint32_t i) { SolveContacts(context_, i, i + 1); }
  bodies::Support SupportOf(uint32_t i, const Vector3d& place, const Vector3d& n) const {
    const ReferenceColliders& colliders = context_.colliders;
    bodies::Support best;
    double most_opposite = 0;
    for (size_t c = 0; c < colliders.size(); ++c) {
      const ContactImpulse& beta = context_.beta[i * colliders.size() + c];
      if (colliders.IsBody(c) || !(beta.normal > 0)) continue;
      const Vector3d its = colliders.AtEnd(c, place).normal;
      if (-its.dot(n) <= most_opposite) continue;
      most_opposite = -its.dot(n);
      const double grip =
          context_.parameters.friction_static * beta.normal - beta.tangential.norm();
      best = {true, c, its, std::max(grip, 0.0)};
    }
    return best;
  }
  Vector3d VelocityOfSupport(const bodies::Support& support, const Vector3d& place) const {
    return context_.colliders.VelocityAtEnd(support.collider, place);
  }
  void Load(uint32_t i, const bodies::Support& support, const Vector3d& place,
            const Vector3d& impulse) {
    ContactImpulse& beta = context_.beta[i * context_.colliders.size() + support.collider];
    const Vector3d change = -impulse / context_.model.masses_kg()[i];
    const double along = change.dot(support.n);
    beta.normal = std::max(beta.normal + along, 0.0);
    const double friction = context_.parameters.friction_static;
    beta.tangential = bodies::LimitFriction(beta.tangential + (change - along * support.n),
                                            beta.normal, friction, friction);
    if (context_.impulses == nullptr) return;
    context_.impulses->ToCollider(support.collider, impulse,
                                  place - context_.colliders.PivotAtEnd(support.collider));
    context_.impulses->OnParticle(i, support.collider, -impulse);
  }
  void PassOn(size_t k, uint32_t i) { context_.Pull(i, context_.bodies.LastImpulse(k)); }

 private:
  StepContext& context_;
  std::vector<Vector3d>& velocities_;
  bool has_colliders_ = false;
};

}  // namespace

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
  PressedCloth cloth(context, context.u);
  for (size_t k = 0; k < bodies.size(); ++k) {
    bodies::ParticleSweep<PressedCloth> sweep(bodies, k, cloth);
    for (uint32_t i = 0; i < context.model.particle_count(); ++i) {
      if (context.w[i] != 0) change = std::max(change, sweep.Solve(i));
    }
    sweep.Finish();
    for (const Grip& held : context.held) change = std::max(change, sweep.Solve(held.particle));
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
  PressedCloth cloth(context, state.velocities_m_per_s);
  for (size_t k = 0; k < bodies.size(); ++k) {
    for (const uint32_t i : bodies.PushedBy(k)) {
      bodies::CorrectParticle(bodies, k, i, state.positions_m[i], cloth);
    }
  }
  bodies.CorrectColliders();
}

}  // namespace drape::reference
