#include "server/solver/cpu/alone/bodies.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "server/solver/bodies/pressed_particles.h"
#include "server/solver/cpu/alone/contacts.h"

namespace drape::cpu {
namespace {

using Eigen::Vector3d;

// Relative to the lengths that a distance is computed from: far above the rounding of its few
// operations, so that nothing in reach is left out.
constexpr float kReachRounding = 1e-5f;

// Where particles may touch a body.
class Reach {
 public:
  Reach(double radius_m, const Vector3d& centre_m) : radius_m_(radius_m) { MoveTo(centre_m); }
  void MoveTo(const Vector3d& centre_m) {
    centre_ = ToVec4(centre_m);
    const auto radius = static_cast<float>(radius_m_);
    const Vec4 size = Abs(centre_);
    const float widened = radius + kReachRounding * (radius + size[0] + size[1] + size[2]);
    radius_sq_ = widened * widened;
  }
  bool Has(Vec4 place) const {
    const Vec4 d = place - centre_;
    return !(Dot(d, d) > radius_sq_);  // what is no number, too
  }

 private:
  double radius_m_;
  Vec4 centre_{};
  float radius_sq_ = 0;
};

// What `pressed_particles.h` asks for.
class PressedCloth {
 public:
  explicit PressedCloth(const StepContext& context) : context_(context) {}

  bodies::Particle ParticleOf(uint32_t i) const {
    const bool is_free = context_.held.IsFree(i);
    return {
        i, ToVector3d(context_.scratch.state.positions[i]),
        is_free ? double{context_.model.free_masses[i]} : std::numeric_limits<double>::infinity()};
  }
  Vector3d Velocity(uint32_t i) const { return ToVector3d(context_.scratch.state.velocities[i]); }
  void SetVelocity(uint32_t i, const Vector3d& u) {
    context_.scratch.state.velocities[i] = ToVec4(u);
  }
  bool HasColliders() const { return !context_.scratch.reach.near.empty(); }
  void Settle(uint32_t i) { SolveContactsOfParticle(context_, i); }
  bodies::Support SupportOf(uint32_t i, const Vector3d& place, const Vector3d& n) const {
    const std::vector<MovingSurface>& surfaces = context_.scratch.surfaces;
    bodies::Support best;
    double most_opposite = 0;
    for (size_t c = 0; c < surfaces.size(); ++c) {
      const ContactImpulses& contact = context_.scratch.contacts[i * surfaces.size() + c];
      if (!(contact.normal > 0)) continue;
      const Vector3d its = ToVector3d(surfaces[c].GapAtEnd(ToVec4(place)).normal);
      if (-its.dot(n) <= most_opposite) continue;
      most_opposite = -its.dot(n);
      const double friction = context_.scratch.bodies.numbers().friction_static;
      const double grip = friction * double{contact.normal} - double{Length(contact.tangent)};
      best = {true, c, its, std::max(grip, 0.0)};
    }
    return best;
  }
  Vector3d VelocityOfSupport(const bodies::Support& support, const Vector3d& place) const {
    return ToVector3d(context_.scratch.surfaces[support.collider].VelocityAtEnd(ToVec4(place)));
  }
  void Load(uint32_t i, const bodies::Support& support, const Vector3d& place,
            const Vector3d& impulse) {
    const size_t count = context_.scratch.surfaces.size();
    ContactImpulses& contact = context_.scratch.contacts[i * count + support.collider];
    const Vector3d change = -impulse / double{context_.model.free_masses[i]};
    const double along = change.dot(support.n);
    const double normal = std::max(double{contact.normal} + along, 0.0);
    contact.normal = static_cast<float>(normal);
    const BodyNumbers& numbers = context_.scratch.bodies.numbers();
    const Vector3d tangent = ToVector3d(contact.tangent) + (change - along * support.n);
    contact.tangent = ToVec4(
        bodies::LimitFriction(tangent, normal, numbers.friction_static, numbers.friction_static));
    if (ImpulseSums* const sums = context_.impulses()) {
      sums->Push(i, support.collider, ToVec4(-impulse), ToVec4(place));
    }
  }
  // What the last contact of body k gave to a held particle, others get.
  void PassOn(size_t k, uint32_t i) {
    if (ImpulseSums* const sums = context_.impulses()) {
      sums->Pull(i, ToVec4(context_.scratch.bodies.LastImpulse(k)));
    }
  }

 private:
  const StepContext& context_;
};

}  // namespace

void BeginBodies(const StepContext& context) {
  Bodies& bodies = context.scratch.bodies;
  bodies = {};
  if (!context.controls.has_bodies) return;
  bodies = Bodies(context.colliders, context.collider_motions, context.controls.bodies,
                  context.model.particle_count, std::numeric_limits<float>::epsilon() / 2);
  if (context.asks_for_contacts) bodies.KeepContacts();
}

void PredictBodies(const StepContext& context) {
  Bodies& bodies = context.scratch.bodies;
  if (bodies.empty() || !bodies.HasRebounds()) return;
  const PressedCloth cloth(context);
  for (size_t k = 0; k < bodies.size(); ++k) {
    for (uint32_t i = 0; i < context.model.particle_count; ++i) {
      bodies.Predict(k, cloth.ParticleOf(i), cloth.Velocity(i));
    }
  }
}

bool SolveBodies(const StepContext& context) {
  Bodies& bodies = context.scratch.bodies;
  if (bodies.empty()) return false;
  const FloatState& state = context.scratch.state;
  const float interval = context.substep.interval;
  PressedCloth cloth(context);
  double largest_change = 0;
  for (size_t k = 0; k < bodies.size(); ++k) {
    Reach reach(bodies.ReachOf(k), bodies.CentreAtEnd(k));
    bodies::ParticleSweep<PressedCloth> sweep(bodies, k, cloth);
    const auto solve = [&](uint32_t i) {
      const bool is_near = reach.Has(state.positions[i] + interval * state.velocities[i]);
      if (!is_near && !bodies.HasPushed(k, i)) return;
      const double change = sweep.Solve(i);
      if (change == 0) return;
      largest_change = std::max(largest_change, change);
      reach.MoveTo(bodies.CentreAtEnd(k));
    };
    for (const uint32_t i : context.held.free_particles) solve(i);
    sweep.Finish();
    // What is held gives way to nothing, so it comes last.
    for (const uint32_t i : context.held.particles) solve(i);
  }
  largest_change = std::max(largest_change, bodies.SolveColliders());
  return double{interval} * largest_change > double{context.controls.contact_tolerance} ||
         context.controls.tolerance == 0;
}

void IntegrateBodies(const StepContext& context) {
  context.scratch.bodies.End();
}

void CorrectBodies(const StepContext& context) {
  Bodies& bodies = context.scratch.bodies;
  const FloatState& state = context.scratch.state;
  PressedCloth cloth(context);
  for (size_t k = 0; k < bodies.size(); ++k) {
    for (const uint32_t i : bodies.PushedBy(k)) {
      bodies::CorrectParticle(bodies, k, i, ToVector3d(state.positions[i]), cloth);
    }
  }
  bodies.CorrectColliders();
}

}  // namespace drape::cpu
