#include "server/solver/cpu/alone/contacts.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <span>
#include <type_traits>

#include "server/solver/cpu/formulas/constraint_math.h"
#include "server/solver/cpu/formulas/contact_math-inl.h"
#include "server/solver/cpu/step/collider_gap.h"
#include "server/solver/cpu/step/collider_surface.h"

namespace drape::cpu {
namespace {

using namespace HWY_NAMESPACE;  // contact_math-inl.h; nothing here depends on what it is

// Those near colliders that rest as described.
class RestingSurfaces {
 public:
  explicit RestingSurfaces(const StepContext& context)
      : colliders_(context.controls.colliders.data()), near_(context.scratch.reach.near) {}
  size_t size() const { return near_.size(); }
  RestingSurface operator[](size_t k) const { return RestingSurface(colliders_[near_[k]]); }

 private:
  const FloatCollider* colliders_;
  std::span<const uint32_t> near_;
};

// The near colliders as a list of surfaces, of one type or the other.
template <class Function>
auto WithSurfaces(const StepContext& context, const Function& function) {
  if (context.collider_motions.empty()) return function(RestingSurfaces(context));
  return function(std::span<const MovingSurface>(context.scratch.surfaces));
}

// Relative to the surface where the particle is.
template <class Surface>
Vec4 VelocityBefore(const Surface& surface, Vec4 p, Vec4 v) {
  if constexpr (Surface::kMoves) return v - surface.VelocityAtStart(p);
  return v;
}

// From positions and velocities before the substep. Returns whether a particle has quiet links.
template <class Surfaces>
bool PredictContactsOf(const StepContext& context, const Surfaces& surfaces,
                       std::span<const uint32_t> particles) {
  const FloatControls& controls = context.controls;
  StepScratch& scratch = context.scratch;
  const bool has_quiet_links = controls.plan.solver.has_quiet_links;
  bool has_quiet_particles = false;
  for (const uint32_t i : particles) {
    const Vec4 p = scratch.state.positions[i];
    float quiet_round_off = 0;
    for (size_t k = 0; k < surfaces.size(); ++k) {
      const size_t place = i * surfaces.size() + k;
      // The speed of a rebound is that when the substep starts.
      if (!controls.has_restitution && surfaces[k].IsClearAtStart(scratch.clearances[place], p)) {
        continue;
      }
      const Gap gap = surfaces[k].GapAtStart(p);
      scratch.clearances[place] = surfaces[k].ClearanceAtStart(p, gap.gap);
      ContactImpulses& contact = scratch.contacts[place];
      contact = {Vec4{}, 0, ContactFloor(gap.gap, controls.depenetration_distance), 0};
      if (!controls.has_restitution && !has_quiet_links) continue;
      const Vec4 v = VelocityBefore(surfaces[k], p, scratch.state.velocities[i]);
      if (controls.has_restitution) {
        contact.rebound = ReboundSpeed(gap.gap, gap.normal, v, controls.gravity,
                                       controls.restitution, controls.slowest_rebound);
      }
      quiet_round_off = std::max(quiet_round_off, QuietRoundOff(gap.gap, surfaces[k].RoundOff(p), p,
                                                                v, controls.slowest_landing));
    }
    if (!has_quiet_links) continue;
    scratch.quiet_round_offs[i] = quiet_round_off;
    has_quiet_particles |= quiet_round_off > 0;
  }
  return has_quiet_particles;
}

template <class Surfaces>
void FindContactFloorsOf(const StepContext& context, const Surfaces& surfaces,
                         std::span<const uint32_t> particles) {
  StepScratch& scratch = context.scratch;
  for (const uint32_t i : particles) {
    const Vec4 p = scratch.state.positions[i];
    for (size_t k = 0; k < surfaces.size(); ++k) {
      const size_t place = i * surfaces.size() + k;
      if (surfaces[k].IsClearAtStart(scratch.clearances[place], p)) continue;
      const float gap = surfaces[k].GapAtStart(p).gap;
      scratch.contacts[place].floor = ContactFloor(gap, context.controls.depenetration_distance);
      scratch.clearances[place] = {};
    }
  }
}

// From where particle i, predicted from b, was before the substep to where it will be after it,
// relative to the surface.
template <class Surface>
Vec4 WayOf(const StepContext& context, const Surface& surface, uint32_t i, Vec4 b, Vec4 u) {
  const FloatSubstep& substep = context.substep;
  const Vec4 move = substep.interval * u;
  const Vec4 p = substep.is_two_step ? context.scratch.previous.positions[i] : b;
  const Vec4 way = substep.is_two_step ? (b - p) + move : move;
  if constexpr (Surface::kMoves) return way - surface.WayOf(p);
  return way;
}

// One particle against one collider. Returns whether it changed u.
template <class Surface>
bool SolveContact(const StepContext& context, const Surface& surface, uint32_t i, Vec4 p,
                  ContactImpulses& contact, Vec4& u) {
  const FloatControls& controls = context.controls;
  const float interval = context.substep.interval;
  bool changed = false;
  const Vec4 q = p + interval * u;
  const Gap at_end = surface.GapAtEnd(q);
  const float way = Dot(WayOf(context, surface, i, p, u), at_end.normal);
  const float error = ContactError(at_end.gap, way, surface.RoundOff(q), contact.floor);
  const float normal_impulse =
      ContactImpulse(contact.normal, error, context.substep.inverse_interval);
  const float change = normal_impulse - contact.normal;
  // Changes within the tolerance are applied too, but do not keep the sweeps going: in short
  // substeps friction consists of nothing else.
  u += change * at_end.normal;
  contact.normal = normal_impulse;
  changed |= interval * std::fabs(change) > controls.contact_tolerance;
  const bool has_tangent = Dot(contact.tangent, contact.tangent) > 0;
  if (controls.friction_static > 0 && (contact.normal > 0 || has_tangent)) {
    Vec4 relative = u;
    // With two steps u is the velocity at the end of the substep, else the mean over it.
    if constexpr (Surface::kMoves) {
      relative -= context.substep.is_two_step ? surface.VelocityAtEnd(p + interval * u)
                                              : surface.MeanVelocity(p);
    }
    const float impulse =
        context.substep.is_two_step
            ? WholeImpulse(contact.normal, contact.rebound, Dot(relative, at_end.normal))
            : contact.normal;
    const Vec4 tangent =
        FrictionImpulse(contact.tangent, Tangential(relative, at_end.normal), impulse,
                        controls.friction_static, controls.friction_dynamic);
    const Vec4 tangent_change = tangent - contact.tangent;
    u += tangent_change;
    contact.tangent = tangent;
    changed |= interval * Length(tangent_change) > controls.contact_tolerance;
  }
  return changed;
}

// Returns whether a contact changed; `has_left`: set if a particle has left the range.
template <bool kAsks, class Surfaces>
bool SolveContactsOf(const StepContext& context, const Surfaces& surfaces,
                     std::span<const uint32_t> particles, std::atomic<bool>& has_left) {
  const float interval = context.substep.interval;
  StepScratch& scratch = context.scratch;
  ReachWatch watch(scratch.reach.range, scratch.reach.WatchesSweeps(context.max_iterations));
  bool changed = false;
  for (const uint32_t i : particles) {
    const Vec4 p = scratch.state.positions[i];
    Vec4& u = scratch.state.velocities[i];
    for (size_t k = 0; k < surfaces.size(); ++k) {
      const Vec4 place = p + interval * u;
      [[maybe_unused]] const Vec4 before = u;
      watch.See(place);
      Clearance& clearance = scratch.clearances[i * surfaces.size() + k];
      if (surfaces[k].IsClearAtEnd(clearance, place)) continue;
      ContactImpulses& contact = scratch.contacts[i * surfaces.size() + k];
      changed |= SolveContact(context, surfaces[k], i, p, contact, u);
      if (contact.normal > 0 || Dot(contact.tangent, contact.tangent) > 0) clearance = {};
      if constexpr (kAsks) {
        context.impulses()->Push(i, k, context.model.free_masses[i] * (u - before), place);
      }
    }
    watch.See(p + interval * u);
  }
  if (watch.has_left()) has_left = true;
  return changed;
}

// Whether the particle hit this surface in the substep, which began with the previous state.
template <class Surface>
bool HasLanded(const StepContext& context, const Surface& surface, uint32_t i) {
  const FloatState& previous = context.scratch.previous;
  const Vec4 p = previous.positions[i];
  return IsLanding(surface.GapAtStart(p).normal, VelocityBefore(surface, p, previous.velocities[i]),
                   context.controls.slowest_landing);
}

// A difference over two steps remembers the velocity before an impact: the particle goes on as if
// it had always flown with the velocity that the impact left.
void ForgetFlight(const StepContext& context, uint32_t i, size_t landed_on) {
  const FloatControls& controls = context.controls;
  const FloatState& state = context.scratch.state;
  FloatState& previous = context.scratch.previous;
  const auto flight =
      FlightBefore(state.positions[i], state.velocities[i], controls.gravity, controls.h);
  if (ImpulseSums* const sums = context.impulses()) {
    const Vec4 change = previous.velocities[i] - flight.velocity;
    sums->PushInMemory(i, landed_on, context.model.free_masses[i] * change, state.positions[i]);
  }
  previous.positions[i] = flight.position;
  previous.velocities[i] = flight.velocity;
}

template <bool kAsks, class Surfaces>
void CorrectVelocityOf(const StepContext& context, const Surfaces& surfaces,
                       std::span<const uint32_t> particles) {
  using Surface = std::remove_cvref_t<decltype(surfaces[0])>;
  const FloatControls& controls = context.controls;
  const bool is_two_step = context.substep.is_two_step;
  const float damping_factor = is_two_step ? 1 : context.substep.damping_factor;
  const Vec4 kick = is_two_step ? Vec4{} : controls.gravity * context.substep.half_interval;
  FloatState& state = context.scratch.state;
  for (const uint32_t i : particles) {
    const Vec4 p = state.positions[i];
    Vec4 v = state.velocities[i];
    size_t landed_on = surfaces.size();  // the first one; none
    for (size_t k = 0; k < surfaces.size(); ++k) {
      const size_t place = i * surfaces.size() + k;
      if (context.scratch.clearances[place].way > 0) continue;
      const ContactImpulses& contact = context.scratch.contacts[place];
      if (!(contact.normal > 0)) continue;
      if (is_two_step && landed_on > k && HasLanded(context, surfaces[k], i)) landed_on = k;
      [[maybe_unused]] const Vec4 before = v;
      const Vec4 n = surfaces[k].GapAtEnd(p).normal;
      const auto after_contact = [&](const Vec4& relative) {
        return VelocityAfterContact(relative, n, kick, contact.tangent, contact.normal,
                                    contact.rebound, is_two_step, controls.friction_static,
                                    controls.friction_dynamic);
      };
      if constexpr (Surface::kMoves) {
        const Vec4 of_surface = surfaces[k].VelocityAtEnd(p);
        v = of_surface + after_contact(v - of_surface);
      } else {
        v = after_contact(v);
      }
      if constexpr (kAsks) {
        context.impulses()->Push(i, k, context.model.free_masses[i] * (v - before), p);
      }
    }
    state.velocities[i] = v * damping_factor;
    if (landed_on < surfaces.size()) ForgetFlight(context, i, landed_on);
  }
}

}  // namespace

void PredictContacts(const StepContext& context) {
  if (context.scratch.reach.near.empty()) return;
  context.scratch.has_quiet_particles = WithSurfaces(context, [&](const auto& surfaces) {
    return context.AnyFreeRange([&](std::span<const uint32_t> particles) {
      return PredictContactsOf(context, surfaces, particles);
    });
  });
}

void FindContactFloors(const StepContext& context) {
  if (context.substep.is_two_step || context.scratch.reach.near.empty()) return;
  WithSurfaces(context, [&](const auto& surfaces) {
    context.ForFreeRanges([&](std::span<const uint32_t> particles) {
      FindContactFloorsOf(context, surfaces, particles);
    });
  });
}

bool SolveContacts(const StepContext& context) {
  ColliderReach& reach = context.scratch.reach;
  if (reach.near.empty() && !reach.WatchesSweeps(context.max_iterations)) return false;
  std::atomic<bool> has_left = false;
  const bool has_changed = WithSurfaces(context, [&](const auto& surfaces) {
    return context.AnyFreeRange([&](std::span<const uint32_t> particles) {
      return context.impulses() != nullptr
                 ? SolveContactsOf<true>(context, surfaces, particles, has_left)
                 : SolveContactsOf<false>(context, surfaces, particles, has_left);
    });
  });
  reach.has_left |= has_left;
  return has_changed;
}

void SolveContactsOfParticle(const StepContext& context, uint32_t particle) {
  std::atomic<bool> has_left = false;
  const std::span<const uint32_t> its(&particle, 1);
  WithSurfaces(context, [&](const auto& surfaces) {
    return context.impulses() != nullptr ? SolveContactsOf<true>(context, surfaces, its, has_left)
                                         : SolveContactsOf<false>(context, surfaces, its, has_left);
  });
  context.scratch.reach.has_left |= has_left;
}

void CorrectVelocity(const StepContext& context) {
  // With two steps damping is in the prediction.
  const bool damps = !context.substep.is_two_step && context.substep.damping_factor != 1;
  if (context.scratch.reach.near.empty() && !damps) return;
  WithSurfaces(context, [&](const auto& surfaces) {
    context.ForFreeRanges([&](std::span<const uint32_t> particles) {
      if (context.impulses() != nullptr) {
        CorrectVelocityOf<true>(context, surfaces, particles);
      } else {
        CorrectVelocityOf<false>(context, surfaces, particles);
      }
    });
  });
}

void PlaceColliders(const StepContext& context, uint32_t index, double substep_s) {
  std::vector<MovingSurface>& surfaces = context.scratch.surfaces;
  if (context.collider_motions.empty()) return surfaces.clear();
  if (index > 0) {
    for (MovingSurface& surface : surfaces) surface.Advance();
    return;
  }
  surfaces.clear();
  for (const uint32_t k : context.scratch.reach.near) {
    surfaces.emplace_back(context.controls.colliders[k], context.collider_motions[k], substep_s);
  }
}

}  // namespace drape::cpu
