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

template <class Surfaces>
void PredictContactsOf(GroupContext& context, const Surfaces& surfaces) {
  const VecCloths zero = SplatCloths(0);
  const ContactNumbers numbers = context.contact_numbers();
  VecCloths largest_round_off = zero;
  for (const uint32_t i : context.free_particles) {
    const ClothParticle& particle = context.particles[i];
    VecCloths quiet_round_off = zero;
    for (size_t k = 0; k < surfaces.size(); ++k) {
      PredictContact(numbers, surfaces[k], particle.p, particle.u,
                     context.contacts[i * surfaces.size() + k], quiet_round_off);
    }
    if (!numbers.has_quiet_links) continue;
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
  context.something_holds = {};
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

// With two steps.
HWY_INLINE ParticlesBefore Before(const GroupContext& context, uint32_t i) {
  const auto& [p, v] = context.previous[i];
  return {p, v};
}
template <class Surface>
HWY_INLINE StartOfContact StartOf(const GroupContext& context, const ContactNumbers& numbers,
                                  const Surface& surface, uint32_t i) {
  StartOfContact start{};
  if (!numbers.is_two_step) return start;
  const auto& [p, v] = context.previous[i];
  return StartOf(numbers, surface, p, v);
}

template <bool kAsks, class Surfaces>
MaskCloths SolveContactsOf(GroupContext& context, const Surfaces& surfaces) {
  MaskCloths changed;
  const ContactNumbers numbers = context.contact_numbers();
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
      changed |= SolveContact(
          numbers, surfaces[k], [&] { return Before(context, i); }, context.is_running & is_free,
          particle.p, contacts[k], particle.u, context.something_holds, watch);
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

// Where particle i has landed in a cloth the previous velocity becomes that of `flight`: the first
// collider that it has landed on has done it.
template <class Surfaces>
HWY_NOINLINE void PushInMemory(const GroupContext& context, const Surfaces& surfaces, uint32_t i,
                               const VectorsCloths& flight) {
  const ContactNumbers numbers = context.contact_numbers();
  const VectorsCloths change = context.previous[i].u - flight;
  MaskCloths is_left = SplatCloths(0) >= SplatCloths(0);
  for (size_t k = 0; k < surfaces.size(); ++k) {
    const MaskCloths has_impulse =
        context.contacts[i * surfaces.size() + k].normal > SplatCloths(0);
    const MaskCloths landed =
        is_left & has_impulse & StartOf(context, numbers, surfaces[k], i).has_landed;
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
  const ContactNumbers numbers = context.contact_numbers();
  for (const uint32_t i : context.free_particles) {
    ClothParticle& particle = context.particles[i];
    VectorsCloths v = particle.u;
    MaskCloths has_landed{};
    for (size_t k = 0; k < surfaces.size(); ++k) {
      const ClothContact& contact = context.contacts[i * surfaces.size() + k];
      const MaskCloths has_impulse = contact.normal > zero;
      if (!IsAnyLaneSet(has_impulse)) continue;
      const StartOfContact start = StartOf(context, numbers, surfaces[k], i);
      has_landed |= has_impulse & start.has_landed;
      [[maybe_unused]] const VectorsCloths before = v;
      v = CorrectContact(numbers, surfaces[k], start, particle.p, contact, has_impulse,
                         context.something_holds, v);
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
