// Contacts of a group of cloths; what contacts.cpp does for one cloth.
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
#include "server/solver/cpu/side_by_side/surfaces-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// Relative to the surface where the particle is.
template <class Surface>
HWY_INLINE VectorsCloths VelocityBefore(const Surface& surface, const VectorsCloths& p,
                                        const VectorsCloths& v) {
  if constexpr (Surface::kMoves) return v - surface.VelocityAtStart(p);
  return v;
}

template <class Surfaces>
void PredictContactsOf(GroupContext& context, const Surfaces& surfaces) {
  const VecCloths zero = SplatCloths(0);
  const float depenetration = context.controls.depenetration_distance;
  const bool has_quiet_links = context.controls.plan.solver.has_quiet_links;
  VecCloths largest_round_off = zero;
  for (const uint32_t i : context.free_particles) {
    const VectorsCloths p = context.particles[i].p;
    VecCloths quiet_round_off = zero;
    for (size_t k = 0; k < surfaces.size(); ++k) {
      const auto surface = surfaces[k];
      const ClothGap gap = surface.GapAtStart(p);
      ClothContact& contact = context.contacts[i * surfaces.size() + k];
      contact.tangent = {zero, zero, zero};
      contact.normal = zero;
      contact.floor = ContactFloor(gap.gap, depenetration);
      contact.rebound = zero;
      if (!context.has_restitution && !has_quiet_links) continue;
      const VectorsCloths v = VelocityBefore(surface, p, context.particles[i].u);
      if (context.has_restitution) {
        contact.rebound = ReboundSpeed(gap.gap, gap.normal, v, context.gravity, context.restitution,
                                       context.slowest_rebound);
      }
      quiet_round_off = Max(quiet_round_off, QuietRoundOff(gap.gap, surface.RoundOff(p), p, v,
                                                           context.slowest_landing));
    }
    if (!has_quiet_links) continue;
    if (context.IsHeldBySome(i)) {
      quiet_round_off = Select(context.FreeCloths(i), quiet_round_off, zero);
    }
    context.quiet_round_offs[i] = quiet_round_off;
    largest_round_off = Max(largest_round_off, quiet_round_off);
  }
  context.has_quiet_particles = IsAnyLaneSet(largest_round_off > zero);
}

// From positions and velocities before the substep.
void PredictContacts(GroupContext& context) {
  if (context.collider_count() == 0) return;
  Settle(context);
  WithSurfaces(context, [&](const auto& surfaces) { PredictContactsOf(context, surfaces); });
}

// Again where contacts let the substep end, after particles have been moved.
void FindContactFloors(const GroupContext& context) {
  if (context.substep.is_two_step) return;
  const float depenetration = context.controls.depenetration_distance;
  WithSurfaces(context, [&](const auto& surfaces) {
    for (const uint32_t i : context.free_particles) {
      for (size_t k = 0; k < surfaces.size(); ++k) {
        context.contacts[i * surfaces.size() + k].floor =
            ContactFloor(surfaces[k].GapAtStart(context.particles[i].p).gap, depenetration);
      }
    }
  });
}

// Friction of one particle, predicted from b, against one collider. Returns the lanes that it
// changed beyond the tolerance.
template <class Surface>
MaskCloths SolveFriction(const GroupContext& context, const Surface& surface,
                         const VectorsCloths& b, const VectorsCloths& n, MaskCloths is_active,
                         ClothContact& contact, VectorsCloths& u) {
  const bool is_two_step = context.substep.is_two_step;
  VectorsCloths relative = u;
  // With two steps u is the velocity at the end of the substep, else the mean over it.
  if constexpr (Surface::kMoves) {
    relative = u - (is_two_step ? surface.VelocityAtEnd(b + u * context.substep.interval)
                                : surface.MeanVelocity(b));
  }
  const VecCloths impulse = is_two_step
                                ? WholeImpulse(contact.normal, contact.rebound, Dot(relative, n))
                                : contact.normal;
  const VectorsCloths tangent = FrictionImpulse(contact.tangent, Tangential(relative, n), impulse,
                                                context.friction_static, context.friction_dynamic);
  const VectorsCloths change = tangent - contact.tangent;
  u = Select(is_active, u + change, u);
  contact.tangent = Select(is_active, tangent, contact.tangent);
  return is_active & (SplatCloths(context.substep.interval) * Sqrt(Dot(change, change)) >
                      SplatCloths(context.controls.contact_tolerance));
}

// From where particle i, predicted from b, was before the substep to where it will be after it,
// relative to the surface.
template <class Surface>
HWY_INLINE VectorsCloths WayOf(const GroupContext& context, const Surface& surface, uint32_t i,
                               const VectorsCloths& b, const VectorsCloths& u) {
  const bool is_two_step = context.substep.is_two_step;
  const VectorsCloths move = u * context.substep.interval;
  const VectorsCloths p = is_two_step ? context.previous[i].p : b;
  const VectorsCloths way = is_two_step ? (b - p) + move : move;
  if constexpr (Surface::kMoves) return way - surface.WayOf(p);
  return way;
}

// Whether contacts have given one of the cloths an impulse in this substep.
HWY_INLINE bool HasImpulse(const ClothContact& contact) {
  const VecCloths zero = SplatCloths(0);
  return IsAnyLaneSet((contact.normal > zero) | (Dot(contact.tangent, contact.tangent) > zero));
}

// One particle against one collider in some of the cloths. `after()` is called where it may have
// changed u.
template <class Surface, class After>
MaskCloths SolveContact(const GroupContext& context, const Surface& surface, uint32_t i,
                        MaskCloths cloths, const VectorsCloths& p, ClothContact& contact,
                        VectorsCloths& u, const After& after) {
  const VecCloths zero = SplatCloths(0);
  const float interval = context.substep.interval;
  const VectorsCloths q = p + u * interval;
  const ClothGap at_end = surface.GapAtEnd(q);
  const VecCloths round_off = surface.RoundOff(q);
  // With such a gap the error is more than 0, whatever the way (ContactError).
  const bool is_apart = AreAllLanesSet(at_end.gap > round_off + round_off);
  if (is_apart && !HasImpulse(contact)) return {};
  const VecCloths way = Dot(WayOf(context, surface, i, p, u), at_end.normal);
  const VecCloths error = ContactError(at_end.gap, way, round_off, contact.floor);
  const VecCloths impulse = ContactImpulse(contact.normal, error, context.substep.inverse_interval);
  if (!IsAnyLaneSet(impulse > zero) && !HasImpulse(contact)) return {};
  const VecCloths change = impulse - contact.normal;
  u = Select(cloths, u + change * at_end.normal, u);
  contact.normal = Select(cloths, impulse, contact.normal);
  const VecCloths tolerance = SplatCloths(context.controls.contact_tolerance);
  const MaskCloths changed = cloths & (SplatCloths(interval) * Abs(change) > tolerance);
  const MaskCloths has_friction =
      (context.friction_static > zero) &
      ((contact.normal > zero) | (Dot(contact.tangent, contact.tangent) > zero));
  const MaskCloths slips =
      SolveFriction(context, surface, p, at_end.normal, cloths & has_friction, contact, u);
  after();
  return changed | slips;
}

template <bool kAsks, class Surfaces>
MaskCloths SolveContactsOf(GroupContext& context, const Surfaces& surfaces) {
  MaskCloths changed;
  const bool watches = context.reach.WatchesSweeps(context.max_iterations);
  const MaskCloths all = SplatCloths(0) >= SplatCloths(0);
  for (const uint32_t i : context.free_particles) {
    ClothParticle& particle = context.particles[i];
    ClothContact* const contacts = context.contacts + i * surfaces.size();
    const MaskCloths is_free = context.IsHeldBySome(i) ? context.FreeCloths(i) : all;
    const auto watch = [&] {
      if (!watches) return;
      const MaskCloths is_held =
          Holds(context.range, particle.p + particle.u * context.substep.interval);
      context.is_held &= is_held | AndNot(is_free, all);
    };
    watch();
    for (size_t k = 0; k < surfaces.size(); ++k) {
      [[maybe_unused]] const VectorsCloths before = particle.u;
      changed |= SolveContact(context, surfaces[k], i, context.is_running & is_free, particle.p,
                              contacts[k], particle.u, watch);
      if constexpr (kAsks) {
        context.given->Push(i, k, context.given->Mass(i) * (particle.u - before),
                            particle.p + before * context.substep.interval);
      }
    }
  }
  return changed;
}

// One sweep. Returns the lanes in which an impulse was larger than the tolerance.
MaskCloths SolveContacts(GroupContext& context) {
  if (context.collider_count() == 0 && !context.reach.WatchesSweeps(context.max_iterations)) {
    return {};
  }
  return WithSurfaces(context, [&](const auto& s) {
    return context.given != nullptr ? SolveContactsOf<true>(context, s)
                                    : SolveContactsOf<false>(context, s);
  });
}

// Those of the particle that hit this surface in the substep, which began with the previous state.
template <class Surface>
MaskCloths HaveLanded(const GroupContext& context, const Surface& surface, uint32_t i) {
  const auto& [p, v] = context.previous[i];
  return IsLanding(surface.GapAtStart(p).normal, VelocityBefore(surface, p, v),
                   context.slowest_landing);
}

// Where particle i has landed in a cloth the previous velocity becomes that of `flight`: the first
// collider that it has landed on has done it.
template <class Surfaces>
HWY_NOINLINE void PushInMemory(const GroupContext& context, const Surfaces& surfaces, uint32_t i,
                               const VectorsCloths& flight) {
  const VectorsCloths change = context.previous[i].u - flight;
  MaskCloths is_left = SplatCloths(0) >= SplatCloths(0);
  for (size_t k = 0; k < surfaces.size(); ++k) {
    const MaskCloths has_impulse =
        context.contacts[i * surfaces.size() + k].normal > SplatCloths(0);
    const MaskCloths landed = is_left & has_impulse & HaveLanded(context, surfaces[k], i);
    is_left = AndNot(landed, is_left);
    const VectorsCloths impulse = context.given->Mass(i) * change;
    context.given->PushInMemory(i, k, Select(landed, impulse, GroupImpulses::None()),
                                context.particles[i].p);
  }
}

template <bool kAsks, class Surfaces>
void CorrectVelocityOf(const GroupContext& context, const Surfaces& surfaces) {
  const bool is_two_step = context.substep.is_two_step;  // damping is in the prediction
  const VecCloths zero = SplatCloths(0);
  const VectorsCloths kick = is_two_step ? VectorsCloths{zero, zero, zero}
                                         : context.gravity * context.substep.half_interval;
  for (const uint32_t i : context.free_particles) {
    ClothParticle& particle = context.particles[i];
    VectorsCloths v = particle.u;
    MaskCloths has_landed{};
    for (size_t k = 0; k < surfaces.size(); ++k) {
      const ClothContact& contact = context.contacts[i * surfaces.size() + k];
      const MaskCloths has_impulse = contact.normal > zero;
      if (!IsAnyLaneSet(has_impulse)) continue;
      const auto surface = surfaces[k];
      if (is_two_step) has_landed |= has_impulse & HaveLanded(context, surface, i);
      const VectorsCloths n = surface.GapAtEnd(particle.p).normal;
      [[maybe_unused]] const VectorsCloths before = v;
      const auto after_contact = [&](const VectorsCloths& relative) {
        return VelocityAfterContact(relative, n, kick, contact.tangent, contact.normal,
                                    contact.rebound, is_two_step, context.friction_static,
                                    context.friction_dynamic);
      };
      if constexpr (decltype(surface)::kMoves) {
        const VectorsCloths of_surface = surface.VelocityAtEnd(particle.p);
        v = Select(has_impulse, of_surface + after_contact(v - of_surface), v);
      } else {
        v = Select(has_impulse, after_contact(v), v);
      }
      if constexpr (kAsks) {
        context.given->Push(i, k, context.given->Mass(i) * (v - before), particle.p);
      }
    }
    if (!is_two_step) v = context.damping_factor * v;
    particle.u = context.IsHeldBySome(i) ? Select(context.FreeCloths(i), v, particle.u) : v;
    if (!IsAnyLaneSet(has_landed)) continue;
    const auto flight = FlightBefore(particle.p, particle.u, context.gravity, context.controls.h);
    ClothParticle& previous = context.previous[i];
    if constexpr (kAsks) PushInMemory(context, surfaces, i, flight.velocity);
    previous.p = Select(has_landed, flight.position, previous.p);
    previous.u = Select(has_landed, flight.velocity, previous.u);
  }
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
  WithSurfaces(context, [&](const auto& surfaces) {
    if (context.given != nullptr) {
      CorrectVelocityOf<true>(context, surfaces);
    } else {
      CorrectVelocityOf<false>(context, surfaces);
    }
  });
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
