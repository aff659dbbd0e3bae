// Contacts of a group of cloths with resting colliders; what contacts.cpp does for one cloth.
// Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_CONTACTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_CONTACTS_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_CONTACTS_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_CONTACTS_INL_H_
#endif

#include "server/solver/cpu/formulas/contact_math-inl.h"
#include "server/solver/cpu/side_by_side/advance-inl.h"
#include "server/solver/cpu/side_by_side/state-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

using ClothGap = Gaps<VecCloths, VectorsCloths>;

ClothGap GapAt(const VectorsCloths& q, const ClothCollider& collider) {
  const auto& [kind, point, vector, offset, size, axes] = collider;
  return ShapeGap(kind, q, point, vector, axes, offset);
}

// Of the gap at q [m].
VecCloths TouchRoundOff(const VectorsCloths& q, const ClothCollider& collider) {
  return SplatCloths(kTouchRoundOff) * (SumOfSizes(q) + collider.size);
}

// From positions and velocities before the substep.
void PredictContacts(GroupContext& context) {
  if (context.collider_count() == 0) return;
  Settle(context);
  const VecCloths zero = SplatCloths(0);
  const float depenetration = context.controls.depenetration_distance;
  const bool has_quiet_links = context.controls.plan.solver.has_quiet_links;
  VecCloths largest_round_off = zero;
  for (const uint32_t i : context.model.free_particles) {
    const auto& [p, v] = context.particles[i];
    VecCloths quiet_round_off = zero;
    for (size_t k = 0; k < context.collider_count(); ++k) {
      const ClothGap gap = GapAt(p, context.colliders[k]);
      ClothContact& contact = context.contacts[i * context.collider_count() + k];
      contact.tangent = {zero, zero, zero};
      contact.normal = zero;
      contact.floor = ContactFloor(gap.gap, depenetration);
      contact.rebound = zero;
      if (context.has_restitution) {
        contact.rebound = ReboundSpeed(gap.gap, gap.normal, v, context.gravity, context.restitution,
                                       context.slowest_rebound);
      }
      if (!has_quiet_links) continue;
      quiet_round_off =
          Max(quiet_round_off, QuietRoundOff(gap.gap, TouchRoundOff(p, context.colliders[k]), p, v,
                                             context.slowest_landing));
    }
    if (!has_quiet_links) continue;
    context.quiet_round_offs[i] = quiet_round_off;
    largest_round_off = Max(largest_round_off, quiet_round_off);
  }
  context.has_quiet_particles = IsAnyLaneSet(largest_round_off > zero);
}

// Again where contacts let the substep end, after particles have been moved.
void FindContactFloors(const GroupContext& context) {
  if (context.substep.is_two_step) return;
  const float depenetration = context.controls.depenetration_distance;
  for (const uint32_t i : context.model.free_particles) {
    for (size_t k = 0; k < context.collider_count(); ++k) {
      const ClothGap gap = GapAt(context.particles[i].p, context.colliders[k]);
      context.contacts[i * context.collider_count() + k].floor =
          ContactFloor(gap.gap, depenetration);
    }
  }
}

// Friction of one particle against one collider. Returns the lanes that it changed beyond the
// tolerance.
MaskCloths SolveFriction(const GroupContext& context, const VectorsCloths& n, MaskCloths is_active,
                         ClothContact& contact, VectorsCloths& u) {
  const VecCloths impulse = context.substep.is_two_step
                                ? WholeImpulse(contact.normal, contact.rebound, Dot(u, n))
                                : contact.normal;
  const VectorsCloths tangent = FrictionImpulse(contact.tangent, Tangential(u, n), impulse,
                                                context.friction_static, context.friction_dynamic);
  const VectorsCloths change = tangent - contact.tangent;
  u = Select(is_active, u + change, u);
  contact.tangent = Select(is_active, tangent, contact.tangent);
  return is_active & (SplatCloths(context.substep.interval) * Sqrt(Dot(change, change)) >
                      SplatCloths(context.controls.contact_tolerance));
}

// From where particle i, predicted from b, was before the substep to where it will be after it.
VectorsCloths WayOf(const GroupContext& context, uint32_t i, const VectorsCloths& b,
                    const VectorsCloths& u) {
  const VectorsCloths move = u * context.substep.interval;
  return context.substep.is_two_step ? (b - context.previous[i].p) + move : move;
}

// One particle against one collider. `after()` is called where it may have changed u.
template <class After>
MaskCloths SolveContact(const GroupContext& context, const ClothCollider& collider, uint32_t i,
                        const VectorsCloths& p, ClothContact& contact, VectorsCloths& u,
                        const After& after) {
  const FloatControls& controls = context.controls;
  const VecCloths zero = SplatCloths(0);
  const float interval = context.substep.interval;
  const VectorsCloths q = p + u * interval;
  const ClothGap at_end = GapAt(q, collider);
  const VecCloths way = Dot(WayOf(context, i, p, u), at_end.normal);
  const VecCloths error = ContactError(at_end.gap, way, TouchRoundOff(q, collider), contact.floor);
  const VecCloths impulse = ContactImpulse(contact.normal, error, context.substep.inverse_interval);
  if (!IsAnyLaneSet((impulse > zero) | (contact.normal > zero) |
                    (Dot(contact.tangent, contact.tangent) > zero))) {
    return {};
  }
  const VecCloths change = impulse - contact.normal;
  u = Select(context.is_running, u + change * at_end.normal, u);
  contact.normal = Select(context.is_running, impulse, contact.normal);
  const MaskCloths changed = context.is_running & (SplatCloths(interval) * Abs(change) >
                                                   SplatCloths(controls.contact_tolerance));
  const MaskCloths has_friction =
      (context.friction_static > zero) &
      ((contact.normal > zero) | (Dot(contact.tangent, contact.tangent) > zero));
  const MaskCloths slips =
      SolveFriction(context, at_end.normal, context.is_running & has_friction, contact, u);
  after();
  return changed | slips;
}

// One sweep. Returns the lanes in which an impulse was larger than the tolerance.
MaskCloths SolveContacts(GroupContext& context) {
  MaskCloths changed;
  const bool watches = context.reach.WatchesSweeps(context.max_iterations);
  if (context.collider_count() == 0 && !watches) return changed;
  for (const uint32_t i : context.model.free_particles) {
    ClothParticle& particle = context.particles[i];
    ClothContact* const contacts = context.contacts + i * context.collider_count();
    const auto watch = [&] {
      if (!watches) return;
      context.is_held &= Holds(context.range, particle.p + particle.u * context.substep.interval);
    };
    watch();
    for (size_t k = 0; k < context.collider_count(); ++k) {
      changed |= SolveContact(context, context.colliders[k], i, particle.p, contacts[k], particle.u,
                              watch);
    }
  }
  return changed;
}

// Those of the particle that hit this collider in the substep, which began with the previous state.
MaskCloths HaveLanded(const GroupContext& context, const ClothCollider& collider, uint32_t i) {
  const ClothParticle& before = context.previous[i];
  return IsLanding(GapAt(before.p, collider).normal, before.u, context.slowest_landing);
}

// Contacts; then damping, which alone is left open.
void CorrectVelocity(GroupContext& context) {
  const bool is_two_step = context.substep.is_two_step;  // damping is in the prediction
  if (context.collider_count() == 0) {
    context.open.damp = context.has_damping && !is_two_step;
    context.open.damping_factor = context.damping_factor;
    return;
  }
  Settle(context);
  const VecCloths zero = SplatCloths(0);
  const VectorsCloths kick = is_two_step ? VectorsCloths{zero, zero, zero}
                                         : context.gravity * context.substep.half_interval;
  for (const uint32_t i : context.model.free_particles) {
    ClothParticle& particle = context.particles[i];
    VectorsCloths v = particle.u;
    MaskCloths has_landed{};
    for (size_t k = 0; k < context.collider_count(); ++k) {
      const ClothContact& contact = context.contacts[i * context.collider_count() + k];
      const MaskCloths has_impulse = contact.normal > SplatCloths(0);
      if (!IsAnyLaneSet(has_impulse)) continue;
      if (is_two_step) has_landed |= has_impulse & HaveLanded(context, context.colliders[k], i);
      const VectorsCloths n = GapAt(particle.p, context.colliders[k]).normal;
      v = Select(
          has_impulse,
          VelocityAfterContact(v, n, kick, contact.tangent, contact.normal, contact.rebound,
                               is_two_step, context.friction_static, context.friction_dynamic),
          v);
    }
    particle.u = is_two_step ? v : context.damping_factor * v;
    if (!IsAnyLaneSet(has_landed)) continue;
    const auto flight = FlightBefore(particle.p, particle.u, context.gravity, context.controls.h);
    ClothParticle& previous = context.previous[i];
    previous.p = Select(has_landed, flight.position, previous.p);
    previous.u = Select(has_landed, flight.velocity, previous.u);
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
