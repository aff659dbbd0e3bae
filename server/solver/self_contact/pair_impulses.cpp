#include "server/solver/self_contact/pair_impulses.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/solver/self_contact/covered_pairs.h"
#include "server/solver/self_contact/pair_friction.h"
#include "shaders/interface/self_contact_search.h"

namespace drape::self_contact {
namespace {

constexpr int kLandingRounds = DRAPE_CONTACT_LANDING_ROUNDS;

}  // namespace

template <class V>
void PairImpulses<V>::Begin(const ContactSurface& surface, const StepNumbers<V>& numbers) {
  surface_ = &surface;
  numbers_ = numbers;
  substep_s_ = numbers.time_step / static_cast<Real>(numbers.substeps);
  has_friction_ = std::ranges::any_of(numbers.frictions,
                                      [](const auto& friction) { return friction.statics > 0; });
}

template <class V>
void PairImpulses<V>::BeginSubstep(uint32_t substep, std::span<const V> velocities) {
  substep_ = substep;
  if (!has_friction_) return;
  const std::span<const V> its = velocities.first(surface_->particle_count());
  start_velocities_.assign(its.begin(), its.end());
}

template <class V>
void PairImpulses<V>::BeginPair(ContactPair<V>& pair, bool is_apart, const V* starts) const {
  pair.is_left_alone = !is_apart;
  pair.floor = std::min(pair.touch, pair.gap + numbers_.depenetration_speed * substep_s_);
  const V first = starts[pair.particles[0]];
  const Real size = std::abs(first[0]) + std::abs(first[1]) + std::abs(first[2]);
  const Real rounding =
      numbers_.touch_round_offs * std::numeric_limits<Real>::epsilon() * (size + pair.touch);
  // The gap is at most the difference of the nearest points.
  const Real above = pair.gap > pair.touch + rounding
                         ? pair.gap - pair.touch
                         : Dot(pair.normal, Weighted(pair, starts)) - pair.touch;
  pair.is_resting = std::abs(above) < rounding;
  // Of what has left the bound of rounding only the rest of the way counts: all of it at once would
  // be a kick.
  if (!pair.is_resting) pair.floor += above > 0 ? rounding : -rounding;
}

template <class V>
FrictionNumbers<ScalarOf<V>> PairImpulses<V>::FrictionOf(const ContactPair<V>& pair) const {
  const uint32_t member = surface_->member_of_particle(pair.particles[0]);
  const uint32_t other = surface_->member_of_particle(pair.particles[3]);
  const FrictionNumbers<Real>& a = numbers_.frictions[member];
  if (member == other) return a;
  const FrictionNumbers<Real>& b = numbers_.frictions[other];
  return {std::sqrt(a.statics * b.statics), std::sqrt(a.dynamics * b.dynamics)};
}

template <class V>
void PairImpulses<V>::FindSpeed(ContactPair<V>& pair) const {
  const V relative = Weighted(pair, start_velocities_.data());
  pair.lands = IsLanding(pair, relative);
  const V sliding = relative - Dot(relative, pair.normal) * pair.normal;
  pair.sliding_speed = pair.lands ? Real{0} : Length(sliding);
}

template <class V>
bool PairImpulses<V>::IsLanding(const ContactPair<V>& pair, const V& relative_velocity) const {
  const Real approach = -Dot(relative_velocity, pair.normal);
  return approach > numbers_.slowest_landing &&
         approach > numbers_.slowest_landing + numbers_.grazing_sine * Length(relative_velocity);
}

// How far the nearest points will be apart, beyond where they touch.
template <class V>
ScalarOf<V> PairImpulses<V>::ErrorOf(const ContactPair<V>& pair, const Prediction& at) {
  const V move = at.interval * Weighted(pair, static_cast<const V*>(at.u));
  // Of what rests the way counts, with all its digits: the height is rounded to some per cent of
  // the way that gravity gives in a short substep.
  return pair.is_resting ? Dot(pair.normal, V(WeightedChange(pair, at.starts, at.base) + move))
                         : Dot(pair.normal, V(Weighted(pair, at.base) + move)) - pair.floor;
}

// A normal that leans over a border is true only where it was found. Before its first impulse it is
// found anew, and then the distance of what is nearest at the end counts.
template <class V>
ScalarOf<V> PairImpulses<V>::ErrorAtBorder(ContactPair<V>& pair, const Prediction& at) const {
  constexpr Real kNoPush = std::numeric_limits<Real>::max();
  if (pair.push == 0 && pair.found_in != substep_) {
    const bool is_apart = FindNormal(at.starts, numbers_.inverse_masses, pair);
    pair.found_in = substep_;
    BeginPair(pair, is_apart, at.starts);
    if (!is_apart || pair.inverse_mass == 0) return kNoPush;
  }
  if (pair.push == 0 && IsCovered(*surface_, {at.starts, surface_->particle_count()}, pair)) {
    return kNoPush;
  }
  const Real error = ErrorOf(pair, at);
  if (error >= 0 || pair.is_resting || !IsAtBorder(pair)) return error;
  std::array<V, 4> ends;
  for (int k = 0; k < 4; ++k) {
    ends[k] = at.base[pair.particles[k]] + at.interval * at.u[pair.particles[k]];
  }
  const V difference = Closest(pair.kind, ends).difference;
  // What has come to the other side has no true distance.
  if (Dot(pair.normal, difference) <= 0) return error;
  return std::max(error, Length(difference) - pair.floor);
}

template <class V>
ScalarOf<V> PairImpulses<V>::Push(ContactPair<V>& pair, const Prediction& at) {
  Real error = ErrorOf(pair, at);
  if (error >= 0 && pair.push == 0) return 0;
  if (IsAtBorder(pair)) {
    error = ErrorAtBorder(pair, at);
    if (error >= 0 && pair.push == 0) return 0;
  }
  const Real push = std::max(pair.push - error / at.interval, Real{0});
  const Real change = push - pair.push;
  pair.push = push;
  V velocity_change = change * pair.normal;
  if (has_friction_) {
    if (!pair.has_hit) FindSpeed(pair);
    const V relative = Weighted(pair, static_cast<const V*>(at.u)) + velocity_change;
    const Real normal_speed = Dot(relative, pair.normal);
    const V sliding = relative - normal_speed * pair.normal;
    // With two steps nothing is left of the speed along the normal (StopTouching).
    const Real whole = numbers_.has_two_steps ? std::max(push - normal_speed, Real{0}) : push;
    const FrictionNumbers<Real> friction = FrictionOf(pair);
    const bool slips =
        Slips(friction, pair.sliding_speed, std::max(whole, numbers_.gravity * substep_s_));
    const V tangent = Friction(friction, slips, V(pair.tangent - sliding), whole);
    velocity_change += tangent - pair.tangent;
    pair.tangent = tangent;
  }
  Apply(pair, velocity_change, numbers_.inverse_masses, at.u);
  Pull(pair, velocity_change, numbers_.inverse_masses, numbers_.pulls.now);
  pair.has_hit |= push > 0;
  return SquaredLength(velocity_change);
}

// What touches has no velocity along the normal, and friction has its part of the impulse.
template <class V>
void PairImpulses<V>::Stop(std::span<ContactPair<V>> pairs, std::span<const uint32_t> active,
                           const typename PlanarGuard<V>::Motion& motion) {
  const auto has_stopped = [&](uint32_t k) {
    return pairs[k].has_hit && pairs[k].inverse_mass != 0 && !pairs[k].is_left_alone;
  };
  landed_.clear();
  for (const uint32_t k : active) {
    if (!has_stopped(k)) continue;
    StopPair(pairs[k], motion.velocities.data(), false);
    if (pairs[k].lands) landed_.push_back(k);
  }
  // Many share the particles of what lands: one round takes from some what others gave.
  for (int round = 2; round <= kLandingRounds; ++round) {
    for (const uint32_t k : landed_) {
      StopPair(pairs[k], motion.velocities.data(), round == kLandingRounds);
    }
  }
  if (motion.previous_velocities.empty()) return;
  for (const uint32_t k : active) {
    if (has_stopped(k)) ForgetLanding(pairs[k], motion);
  }
}

// Of what lands only the last round can tell whether it slides on.
template <class V>
void PairImpulses<V>::StopPair(ContactPair<V>& pair, V* velocities, bool is_last) {
  const V relative = Weighted(pair, static_cast<const V*>(velocities));
  const Real speed = Dot(relative, pair.normal);
  // No more than the pair itself has pushed is taken back.
  const Real change = std::max(-speed, -pair.push);
  pair.push = std::max(pair.push + change, Real{0});
  V velocity_change = change * pair.normal;
  if (has_friction_) {
    const FrictionNumbers<Real> friction = FrictionOf(pair);
    const V stopping = pair.tangent - (relative - speed * pair.normal);
    const Real weight = numbers_.gravity * substep_s_;
    bool slips = Slips(friction, pair.sliding_speed, std::max(pair.push, weight));
    if (pair.lands && is_last) {
      slips = Slips(friction, Length(stopping) - friction.statics * pair.push, weight);
    }
    const V tangent = Friction(friction, slips, stopping, pair.push);
    velocity_change += tangent - pair.tangent;
    pair.tangent = tangent;
  }
  Apply(pair, velocity_change, numbers_.inverse_masses, velocities);
  Pull(pair, velocity_change, numbers_.inverse_masses, numbers_.pulls.now);
}

// With two steps the difference over two substeps remembers the velocity before a hit: what hits
// goes on as if it had always had the velocity that the hit left.
template <class V>
void PairImpulses<V>::ForgetLanding(const ContactPair<V>& pair,
                                    const typename PlanarGuard<V>::Motion& motion) {
  const V before = Weighted(pair, static_cast<const V*>(motion.previous_velocities.data()));
  if (!IsLanding(pair, before)) return;
  const V after = Weighted(pair, static_cast<const V*>(motion.velocities.data()));
  Apply(pair, V(after - before), numbers_.inverse_masses, motion.previous_velocities.data());
  Pull(pair, V(before - after), numbers_.inverse_masses, numbers_.pulls.in_memory);
  const V way = Weighted(pair, static_cast<const V*>(motion.ends.data())) -
                Weighted(pair, static_cast<const V*>(motion.previous_positions.data()));
  Apply(pair, V(way - substep_s_ * after), numbers_.inverse_masses,
        motion.previous_positions.data());
}

template class PairImpulses<Vector3f>;
template class PairImpulses<Vector3d>;

}  // namespace drape::self_contact
