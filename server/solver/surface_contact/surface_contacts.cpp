#include "server/solver/surface_contact/surface_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/solver/collider_contact.h"
#include "server/solver/solver_constants.h"
#include "server/solver/surface_contact/contact_numbers.h"
#include "server/solver/surface_contact/passing-inl.h"
#include "server/solver/surface_contact/surface_looks-inl.h"
#include "server/solver/surface_contact/surface_search-inl.h"

namespace drape::surface_contact {
namespace {

using self_contact::Dot;
using self_contact::Length;
using self_contact::SquaredLength;

template <class V>
ScalarOf<V> LargestSize(const V& v) {
  return self_contact::LargestOf(self_contact::Abs(v));
}

}  // namespace

template <class V>
void SurfaceContacts<V>::Begin(const SurfaceParts& parts, const Solids& solids,
                               const StepNumbers<V>& numbers) {
  parts_ = &parts;
  numbers_ = numbers;
  substep_s_ = numbers.time_step_s / numbers.substeps;
  substep_ = 0;
  ages_after_ = 1 + static_cast<uint32_t>(kPlaneAge_s / substep_s_);
  has_starts_ = false;
  active_.clear();
  solids_.clear();
  contact_count_ = 0;
  has_given_up_ = false;
  for (const uint32_t c : solids.places) {
    const Collider& collider = solids.colliders[c];
    const RigidMotion* const motion = solids.motions.empty() ? nullptr : &solids.motions[c];
    if (!TouchesEdges(solids.edges, collider, motion)) continue;
    solids_.push_back({PlacedSolid<V>(collider, motion, solids.thickness_m, c)});
  }
}

template <class V>
void SurfaceContacts<V>::Find(std::span<const V> positions, std::span<const V> velocities) {
  ++substep_;
  active_.clear();
  active_particles_.clear();
  has_starts_ = false;
  if (solids_.empty()) return;
  const auto h = static_cast<Real>(substep_s_);
  const Real fall = Length(numbers_.gravity) * h * h;
  if (substep_ == 1) least_dip_ = LeastDip(positions);
  for (SolidState& solid : solids_) {
    Ask(numbers_.interruption);
    solid.placed.Place((substep_ - 1) * substep_s_, substep_ * substep_s_);
    if (solid.needs_search) Search(solid, positions, velocities);
    solid.expected = static_cast<Real>(kWayMargin) * solid.particle_way + fall + solid.own_way;
    LookAtDue(solid, positions, velocities);
    has_starts_ |= solid.has_any();
  }
  const auto particles_begin = static_cast<std::ptrdiff_t>(active_.size());
  // After all edges and triangles: what these push does not get across either.
  for (SolidState& solid : solids_) {
    Ask(numbers_.interruption);
    DropPassing(solid);
    const Real thin = static_cast<Real>(kThinShare) * solid.placed.solid().half_width();
    if (solid.expected > thin) FindPassing(solid, positions);
  }
  for (const bool are_particles : {true, false}) {
    for (SolidState& solid : solids_) {
      for (Contact& contact : solid.passing) {
        if ((contact.count == 1) == are_particles) Activate(contact, positions, velocities);
      }
    }
    if (are_particles) active_particles_.assign(active_.begin() + particles_begin, active_.end());
  }
  if (!has_starts_) return;
  starts_.assign(positions.begin(), positions.end());
  velocities_.assign(velocities.begin(), velocities.end());
}

template <class V>
void SurfaceContacts<V>::Activate(Contact& contact, std::span<const V> positions,
                                  std::span<const V> velocities) {
  V place{};
  contact.velocity = V{};
  contact.inverse_mass = 0;
  for (uint32_t k = 0; k < contact.count; ++k) {
    const uint32_t i = contact.particles[k];
    place += contact.weights[k] * positions[i];
    contact.velocity += contact.weights[k] * velocities[i];
    contact.inverse_mass += contact.weights[k] * contact.weights[k] * numbers_.inverse_masses[i];
  }
  if (!(contact.inverse_mass > 0) && !contact.is_passing) return;
  contact.push = 0;
  contact.tangent = V{};
  contact.given = contact.given_in_memory = V{};
  if (contact.has_plane) SetUp(contact, place);
  active_.push_back(&contact);
}

// What the substep needs of a plane; `place`: of the point when it starts.
template <class V>
void SurfaceContacts<V>::SetUp(Contact& contact, const V& place) const {
  const PlacedSolid<V>& placed = solids_[contact.solid].placed;
  const auto h = static_cast<Real>(substep_s_);
  contact.gap = Dot(contact.normal, placed.DescribedAtStart(place)) - contact.level;
  contact.push_along = placed.TurnedAtEnd(contact.normal);
  contact.surface_way = placed.WayOf(place);
  const double recovery_m_per_s =
      contact.count == 1 ? kMaxDepenetrationSpeed_m_per_s : kRecovery_m_per_s;
  contact.floor = std::min(contact.gap + static_cast<Real>(recovery_m_per_s) * h, Real{0});
  // At once: before the particle's own contact pushes it on.
  if (contact.has_slipped) contact.floor = 0;
  // What lies on the surface, to rounding, is moved by its way alone, which has all its digits.
  const Real rounding = static_cast<Real>(kTouchRoundOffs / 2) *
                        std::numeric_limits<Real>::epsilon() *
                        (LargestSize(place) + std::abs(contact.level));
  if (std::abs(contact.gap) <= rounding) contact.gap = contact.floor = 0;
  const V relative = contact.velocity - placed.VelocityAtStart(place);
  const V normal = placed.TurnedAtStart(contact.normal);
  const Real approach = -Dot(relative, normal);
  contact.has_landed =
      approach > numbers_.slowest_landing + static_cast<Real>(kGrazingSine) * Length(relative);
  contact.rebound = 0;
  if (numbers_.restitution > 0) {
    const Real gained = -2 * Dot(numbers_.gravity, normal) * std::max(contact.gap, Real{0});
    const Real arrival = std::sqrt(std::max(approach * approach + gained, Real{0}));
    if (std::min(arrival, 2 * approach) > numbers_.slowest_rebound) {
      contact.rebound = numbers_.restitution * arrival;
    }
  }
}

// Coulomb's law on accumulated impulses.
template <class V>
V SurfaceContacts<V>::Friction(const V& wanted, Real push) const {
  const Real size = Length(wanted);
  if (size <= numbers_.friction_static * push) return wanted;
  return wanted * (numbers_.friction_dynamic * push / size);
}

// Changes the velocity of the point.
template <class V>
void SurfaceContacts<V>::Apply(Contact& contact, const V& change, V* velocities) const {
  const V impulse = change / contact.inverse_mass;
  for (uint32_t k = 0; k < contact.count; ++k) {
    const uint32_t i = contact.particles[k];
    velocities[i] += (contact.weights[k] * numbers_.inverse_masses[i]) * impulse;
  }
}

// The way of the point in the substep, relative to the surface.
template <class V>
V SurfaceContacts<V>::WayOf(const Contact& contact, const V* base, const V* u,
                            Real interval) const {
  V way = -contact.surface_way;
  for (uint32_t k = 0; k < contact.count; ++k) {
    const uint32_t i = contact.particles[k];
    way += contact.weights[k] * ((base[i] - starts_[i]) + interval * u[i]);
  }
  return way;
}

template <class V>
bool SurfaceContacts<V>::SolveOne(Contact& contact, const V* base, V* u, Real interval,
                                  Real least_change) {
  if (!contact.is_passing) return SolvePlane(contact, base, u, interval, least_change);
  if (contact.count == 1) {
    if (!contact.has_plane && !FindMeeting(contact, base, u, interval)) return false;
    return SolvePlane(contact, base, u, interval, least_change);
  }
  bool has_changed = contact.has_plane && SolvePlane(contact, base, u, interval, least_change);
  for (int k = 0; looks_on_ways_ && k < kMeetings && FindMeetingOfEdge(contact, base, u, interval);
       ++k) {
    has_changed |= SolvePlane(contact, base, u, interval, least_change);
  }
  return has_changed;
}

template <class V>
bool SurfaceContacts<V>::SolvePlane(Contact& contact, const V* base, V* u, Real interval,
                                    Real least_change) {
  const V& n = contact.push_along;
  const V way = WayOf(contact, base, u, interval);
  const Real error = contact.gap + Dot(n, way) - contact.floor;
  if (error >= 0 && contact.push == 0) return false;
  const Real push = std::max(contact.push - error / interval, Real{0});
  V change = (push - contact.push) * n;
  contact.push = push;
  if (numbers_.friction_static > 0) {
    V relative = change;
    for (uint32_t k = 0; k < contact.count; ++k) {
      relative += contact.weights[k] * u[contact.particles[k]];
    }
    const PlacedSolid<V>& placed = solids_[contact.solid].placed;
    if (placed.moves()) {
      V place{};
      for (uint32_t k = 0; k < contact.count; ++k) {
        place += contact.weights[k] * starts_[contact.particles[k]];
      }
      // With two steps u is the velocity at the end of the substep, else the mean over it.
      relative -= numbers_.has_two_steps
                      ? placed.VelocityAtEnd(V(place + way + contact.surface_way))
                      : V(contact.surface_way / interval);
    }
    const Real speed = Dot(relative, n);
    const V sliding = relative - speed * n;
    const Real whole =
        numbers_.has_two_steps ? std::max(push + (contact.rebound - speed), Real{0}) : push;
    const V tangent = Friction(V(contact.tangent - sliding), whole);
    change += tangent - contact.tangent;
    contact.tangent = tangent;
  }
  Apply(contact, change, u);
  contact.given += change / contact.inverse_mass;
  return SquaredLength(change) > least_change * least_change;
}

template <class V>
bool SurfaceContacts<V>::Solve(const V* base, V* u, Real interval, Real least_change) {
  bool has_changed = false, is_passed = false;
  // What folds around something thin is pushed from both sides of it, each time by what the other
  // side has pushed.
  const int passes = active_particles_.empty() ? 1 : kPasses;
  for (int k = 0; k < passes && (k == 0 || is_passed); ++k) {
    is_passed = false;
    looks_on_ways_ = k == 0;
    SeldomInterruption interruption(numbers_.interruption);
    for (Contact* const contact : active_) {
      interruption.Check();
      is_passed |= SolveOne(*contact, base, u, interval, least_change);
    }
    has_changed |= is_passed;
  }
  // The last word: what edges pushed does not get across.
  for (Contact* const contact : active_particles_) {
    has_changed |= SolveOne(*contact, base, u, interval, least_change);
  }
  return has_changed;
}

template <class V>
ScalarOf<V> SurfaceContacts<V>::LargestError(const V* base, const V* u, Real interval) const {
  Real largest = 0;
  for (const Contact* const contact : active_) {
    if (!contact->has_plane) continue;
    const V way = WayOf(*contact, base, u, interval);
    largest = std::max(largest, contact->floor - contact->gap - Dot(contact->push_along, way));
  }
  return largest;
}

template <class V>
void SurfaceContacts<V>::Advance(std::span<const V> positions) {
  const auto way_from = [&](const std::vector<V>& from) {
    V most{};
    for (size_t i = 0; i < positions.size(); ++i) {
      most = self_contact::Max(most, self_contact::Abs(V(positions[i] - from[i])));
    }
    return Length(most);
  };
  const Real way = has_starts_ ? way_from(starts_) : 0;
  for (SolidState& solid : solids_) {
    Ask(numbers_.interruption);
    Real next = 0;
    if (solid.has_any()) {
      solid.particle_way = way;
      solid.travel += way + solid.own_way;
      for (uint32_t k = 0; k < solid.watched.size(); ++k) {
        const V end = solid.placed.DescribedAtEnd(positions[solid.watched[k]]);
        solid.wakes.Move(k, Length(V(end - solid.described[k])));
        solid.described[k] = end;
      }
      next = static_cast<Real>(kWayMargin) * way + solid.own_way;
    } else if (substep_ % kLookEvery == 0) {
      const auto since = static_cast<Real>(substep_ - solid.searched_in + 1);
      const Real gone = way_from(solid.found_positions);
      solid.particle_way = gone / since;
      solid.travel = gone + since * solid.own_way;
      next = static_cast<Real>(kLookEvery) * (solid.particle_way + solid.own_way);
    }
    solid.needs_search |= !(solid.travel + next <= solid.reach);
  }
}

// As that of particles (correct_velocity), but no more is taken back than was given: other contacts
// share the particles.
template <class V>
void SurfaceContacts<V>::CorrectOne(Contact& contact, const V* positions, V* velocities) {
  const PlacedSolid<V>& placed = solids_[contact.solid].placed;
  const V& n = contact.push_along;
  V place{}, velocity{};
  for (uint32_t k = 0; k < contact.count; ++k) {
    place += contact.weights[k] * positions[contact.particles[k]];
    velocity += contact.weights[k] * velocities[contact.particles[k]];
  }
  const bool is_two_step = numbers_.has_two_steps;
  const V v = velocity - placed.VelocityAtEnd(place);
  const Real speed = Dot(v, n);
  const Real wanted = contact.rebound - speed;
  if (!(wanted > 0) && !is_two_step) return;
  const Real change = std::max(wanted, -contact.push);
  const auto h = static_cast<Real>(substep_s_);
  const V kick = is_two_step ? V{} : V(h / 2 * numbers_.gravity);
  const Real kick_speed = Dot(kick, n);
  const Real stops_kick = is_two_step ? Real{0} : std::clamp(-kick_speed, Real{0}, change);
  const V across_kick = kick - kick_speed * n;
  const V sliding = (v - speed * n) - across_kick;
  V along = sliding;
  if (numbers_.friction_static > 0) {
    along += Friction(V(contact.tangent - sliding),
                      std::max(contact.push + change - stops_kick, Real{0})) -
             contact.tangent;
  }
  along += across_kick;
  if (!is_two_step && numbers_.friction_static > 0) along += Friction(V(-along), stops_kick);
  const V velocity_change = (along + (speed + change) * n) - v;
  Apply(contact, velocity_change, velocities);
  contact.given += velocity_change / contact.inverse_mass;
}

// The point goes on as if it had always flown with the velocity that the impact left.
template <class V>
void SurfaceContacts<V>::ForgetFlight(Contact& contact, const V* positions, const V* velocities,
                                      V* previous_positions, V* previous_velocities) const {
  const auto h = static_cast<Real>(substep_s_);
  V way{}, velocity{}, before{};
  for (uint32_t k = 0; k < contact.count; ++k) {
    const uint32_t i = contact.particles[k];
    way += contact.weights[k] * (positions[i] - previous_positions[i]);
    velocity += contact.weights[k] * velocities[i];
    before += contact.weights[k] * previous_velocities[i];
  }
  const V change = velocity - h * numbers_.gravity - before;
  contact.given_in_memory += change / contact.inverse_mass;
  Apply(contact, change, previous_velocities);
  Apply(contact, V(way - h * (velocity - h / 2 * numbers_.gravity)), previous_positions);
}

template <class V>
void SurfaceContacts<V>::Correct(const V* positions, V* velocities, V* previous_positions,
                                 V* previous_velocities) {
  for (Contact* const contact : active_) {
    if (!(contact->push > 0)) continue;
    CorrectOne(*contact, positions, velocities);
    if (!numbers_.has_two_steps || !contact->has_landed) continue;
    ForgetFlight(*contact, positions, velocities, previous_positions, previous_velocities);
  }
}

template class SurfaceContacts<self_contact::Vector3f>;
template class SurfaceContacts<self_contact::Vector3d>;

}  // namespace drape::surface_contact
