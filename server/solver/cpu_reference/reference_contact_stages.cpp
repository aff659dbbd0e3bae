#include <algorithm>
#include <cmath>
#include <optional>

#include "server/solver/cpu_reference/reference_stages.h"
#include "server/solver/solver_constants.h"

namespace drape::reference {

using Eigen::Vector3d;

namespace {

// Whether a change of velocity of this size keeps the sweeps going. Smaller ones are applied too:
// in short substeps friction consists of nothing else.
bool IsAboveTolerance(const StepContext& context, double velocity_change) {
  const double tolerance = context.plan.tolerance;
  return tolerance == 0 || context.h * velocity_change > tolerance * context.model.length_scale_m();
}

Vector3d Tangential(const Vector3d& v, const Vector3d& n) {
  return v - v.dot(n) * n;
}

// With two steps u is the velocity at the end of the substep, else the mean over it.
Vector3d SurfaceVelocity(const StepContext& context, uint32_t i, size_t c) {
  if (!context.substep.is_two_step) return context.colliders.MeanVelocity(c, context.base[i]);
  return context.colliders.VelocityAtEnd(c, context.base[i] + context.h * context.u[i]);
}

// On which friction is judged in the sweeps. With two steps nothing is left of the velocity along
// the normal: the whole impulse of the substep.
double NormalImpulse(const StepContext& context, uint32_t i, size_t c, double normal_speed) {
  const size_t contact = i * context.colliders.size() + c;
  const double normal = context.beta[contact].normal;
  if (!context.substep.is_two_step) return normal;
  return std::max(normal + (context.rebounds[contact] - normal_speed), 0.0);
}

// A contact has changed a velocity: the collider has got the opposite impulse. `place` is where the
// particle is when the substep ends.
void PushCollider(const StepContext& context, uint32_t i, size_t c, const Vector3d& place,
                  const Vector3d& velocity_change) {
  if (context.impulses == nullptr) return;
  const Vector3d impulse = context.model.masses_kg()[i] * velocity_change;
  context.impulses->ToCollider(c, -impulse, place - context.colliders.PivotAtEnd(c));
  context.impulses->OnParticle(i, c, impulse);
}

// Relative to the surface of collider c when this substep began, with two steps.
Vector3d VelocityAtStart(const StepContext& context, uint32_t i, size_t c) {
  return context.previous.velocities_m_per_s[i] -
         context.colliders.VelocityAtStart(c, context.previous.positions_m[i]);
}

Vector3d NormalAtStart(const StepContext& context, uint32_t i, size_t c) {
  return context.colliders.AtStart(c, context.previous.positions_m[i]).normal;
}

// Whether the particle hit collider c in this substep.
bool HasLanded(const StepContext& context, uint32_t i, size_t c) {
  return IsLanding(VelocityAtStart(context, i, c), NormalAtStart(context, i, c),
                   SlowestLanding(context.parameters));
}

// Whether static friction holds what acts on the particle, apart from what it takes to stop it.
bool Holds(const StepContext& context, uint32_t i, size_t c, const Vector3d& wanted,
           double normal_impulse) {
  const double limit = context.parameters.friction_static * normal_impulse;
  if (wanted.norm() <= limit) return true;
  const Vector3d sliding = Tangential(VelocityAtStart(context, i, c), NormalAtStart(context, i, c));
  return (wanted + sliding).norm() <= limit;
}

// The coefficient of a contact, where `wanted` would stop the sliding. `something_holds`: of the
// whole cloth.
double FrictionOf(const StepContext& context, uint32_t i, size_t c, double wanted,
                  double normal_impulse, bool something_holds) {
  const double statics = context.parameters.friction_static;
  const double dynamics = context.parameters.friction_dynamic;
  if (!HasTwoFrictions(context.parameters)) return statics;
  if (!context.substep.is_two_step || !something_holds || HasLanded(context, i, c)) {
    return wanted > statics * normal_impulse ? dynamics : statics;
  }
  const double speed =
      Tangential(VelocityAtStart(context, i, c), NormalAtStart(context, i, c)).norm();
  return speed > SlipSpeed(statics, normal_impulse, SlowestSlip(context.parameters)) ? dynamics
                                                                                     : statics;
}

// gap >= floor with impulses that only push (Bender et al. 2009, section 3.2, inequality
// constraints), then Coulomb friction against the motion of the substep relative to the surface.
bool SolveContact(StepContext& context, uint32_t i, size_t c, ContactImpulse& beta) {
  const ClothParameters& parameters = context.parameters;
  Vector3d& u = context.u[i];
  const Vector3d place = context.base[i] + context.h * u;
  bool has_changed = false;
  const auto [gap, n] = PredictedContact(context, i, c);
  const double normal =
      std::max(beta.normal - (gap - ContactFloor(context, i, c)) / context.h, 0.0);
  const double normal_change = normal - beta.normal;
  u += normal_change * n;
  PushCollider(context, i, c, place, normal_change * n);
  beta.normal = normal;
  has_changed |= IsAboveTolerance(context, std::abs(normal_change));

  const bool has_friction =
      parameters.friction_static > 0 && (beta.normal > 0 || !beta.tangential.isZero(0));
  if (!has_friction) return has_changed;
  const Vector3d relative = u - SurfaceVelocity(context, i, c);
  const Vector3d sliding = Tangential(relative, n);
  const Vector3d wanted = beta.tangential - sliding;
  const double impulse = NormalImpulse(context, i, c, relative.dot(n));
  if (context.substep.is_two_step && HasTwoFrictions(context.parameters)) {
    context.something_holds |= Holds(context, i, c, wanted, impulse);
  }
  const double friction = FrictionOf(context, i, c, wanted.norm(), impulse, true);
  const Vector3d tangential = FrictionImpulse(wanted, impulse, friction);
  const Vector3d tangential_change = tangential - beta.tangential;
  u += tangential_change;
  PushCollider(context, i, c, place, tangential_change);
  beta.tangential = tangential;
  return has_changed || IsAboveTolerance(context, tangential_change.norm());
}

// A difference over two steps remembers the velocity before an impact: the particle goes on as if
// it had always flown with the velocity that the impact left.
void ForgetFlight(StepContext& context, uint32_t i, size_t c) {
  const double h = context.substep.duration_s;
  const Vector3d& g = context.parameters.gravity_m_per_s2;
  const Vector3d& v = context.state.velocities_m_per_s[i];
  const Vector3d& p = context.state.positions_m[i];
  if (context.impulses != nullptr) {
    const Vector3d change = v - h * g - context.previous.velocities_m_per_s[i];
    const Vector3d impulse = context.model.masses_kg()[i] * change;
    context.impulses->ToColliderInMemory(c, impulse, p - context.colliders.PivotAtEnd(c));
    context.impulses->OnParticleInMemory(i, c, -impulse);
  }
  context.previous.positions_m[i] = p - h * (v - h / 2 * g);
  context.previous.velocities_m_per_s[i] = v - h * g;
}

// No approach velocity is left, and what hits leaves with its rebound speed. With two steps u is
// also the speed at which the error of the substep was removed: none of it is left. Friction is
// judged on the whole impulse of the substep. But with one step velocities also contain the half
// step of gravity that constraints take away in the next substep; what stops that has friction of
// its own.
void CorrectContactVelocity(StepContext& context, uint32_t i, size_t c, double rebound) {
  const ReferenceColliders& colliders = context.colliders;
  const ClothParameters& parameters = context.parameters;
  const bool is_two_step = context.substep.is_two_step;
  const ContactImpulse& beta = context.beta[i * colliders.size() + c];
  const Vector3d& p = context.state.positions_m[i];
  const Vector3d n = colliders.AtEnd(c, p).normal;
  const Vector3d of_surface = colliders.VelocityAtEnd(c, p);
  const Vector3d v = context.state.velocities_m_per_s[i] - of_surface;
  const double change = rebound - v.dot(n);
  if (!(change > 0) && !is_two_step) return;
  const auto friction = [&](const Vector3d& wanted, double normal_impulse) {
    return FrictionImpulse(
        wanted, normal_impulse,
        FrictionOf(context, i, c, wanted.norm(), normal_impulse, context.something_holds));
  };
  const Vector3d kick =
      is_two_step ? Vector3d::Zero() : Vector3d(context.h / 2 * parameters.gravity_m_per_s2);
  const double stops_kick = is_two_step ? 0 : std::clamp(-kick.dot(n), 0.0, change);
  const Vector3d sliding = Tangential(v - kick, n);
  const double normal_impulse = std::max(beta.normal + change - stops_kick, 0.0);
  Vector3d after = sliding + friction(beta.tangential - sliding, normal_impulse) - beta.tangential;
  after += Tangential(kick, n);
  if (!is_two_step) after += friction(-after, stops_kick);
  if (rebound > 0) after += rebound * n;
  const Vector3d before = context.state.velocities_m_per_s[i];
  context.state.velocities_m_per_s[i] =
      colliders.are_moving() ? Vector3d(of_surface + after) : after;
  PushCollider(context, i, c, p, context.state.velocities_m_per_s[i] - before);
}

}  // namespace

ReferenceContact PredictedContact(const StepContext& context, uint32_t i, size_t c) {
  return context.colliders.AtEnd(c, context.base[i] + context.h * context.u[i]);
}

double ContactFloor(const StepContext& context, uint32_t i, size_t c) {
  const bool is_two_step = context.substep.is_two_step;
  const Vector3d& start = is_two_step ? context.previous.positions_m[i] : context.base[i];
  const double gap = context.colliders.AtStart(c, start).gap;
  return std::min(0.0, gap + kMaxDepenetrationSpeed_m_per_s * context.substep.duration_s);
}

void PredictContacts(StepContext& context) {
  context.something_holds = false;
  const ClothParameters& parameters = context.parameters;
  const ReferenceColliders& colliders = context.colliders;
  FillForContacts(context, 0.0, context.rebounds);
  if (!HasRestitution(parameters)) return;
  SeldomInterruption interruption(context.interruption);
  for (uint32_t i = 0; i < context.model.particle_count(); ++i) {
    const Vector3d& p = context.state.positions_m[i];
    for (size_t c = 0; c < colliders.size(); ++c) {
      interruption.Check();
      const Vector3d relative =
          context.state.velocities_m_per_s[i] - colliders.VelocityAtStart(c, p);
      context.rebounds[i * colliders.size() + c] =
          ReboundSpeed(colliders.AtStart(c, p), relative, parameters.gravity_m_per_s2,
                       parameters.restitution, SlowestRebound(parameters));
    }
  }
}

bool SolveContacts(StepContext& context, uint32_t begin, uint32_t end) {
  const size_t collider_count = context.colliders.size();
  bool has_changed = false;
  SeldomInterruption interruption(context.interruption);
  for (uint32_t i = begin; i < end; ++i) {
    if (context.w[i] == 0) continue;
    for (size_t c = 0; c < collider_count; ++c) {
      interruption.Check();
      if (context.colliders.IsBody(c)) continue;  // SolveBodies
      if (SolveContact(context, i, c, context.beta[i * collider_count + c])) has_changed = true;
    }
  }
  return has_changed;
}

// Velocity constraints of the contacts that pushed, after the advance, then damping.
void CorrectVelocity(StepContext& context) {
  const double damping_per_s = context.substep.is_two_step ? 0 : context.parameters.damping_per_s;
  const double decay = std::exp(-damping_per_s * context.h);
  const size_t collider_count = context.colliders.size();
  SeldomInterruption interruption(context.interruption);
  for (uint32_t i = 0; i < context.model.particle_count(); ++i) {
    if (context.w[i] == 0) continue;
    std::optional<size_t> landed_on;  // the first one
    for (size_t c = 0; c < collider_count; ++c) {
      interruption.Check();
      const size_t contact = i * collider_count + c;
      if (!(context.beta[contact].normal > 0)) continue;
      CorrectContactVelocity(context, i, c, context.rebounds[contact]);
      if (context.substep.is_two_step && !landed_on && HasLanded(context, i, c)) landed_on = c;
    }
    if (landed_on) ForgetFlight(context, i, *landed_on);
    if (damping_per_s > 0) context.state.velocities_m_per_s[i] *= decay;
  }
}

}  // namespace drape::reference
