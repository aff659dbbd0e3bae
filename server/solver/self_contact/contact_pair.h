// A pair of primitives of a cloth that may touch, in a substep.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "server/solver/self_contact/closest_side_by_side.h"
#include "server/solver/self_contact/vectors.h"

namespace drape::self_contact {

// Names as in server/solver/method.md, solve_self_contacts.
template <class V>
struct ContactPair {
  using Real = ScalarOf<V>;

  std::array<uint32_t, 4> particles;
  PairKind kind;
  bool is_left_alone = false;  // crossed or touched when the step began
  bool has_hit = false;        // pushed by this substep's impulses or its guard
  bool is_active = false;      // looked at in this substep
  bool is_resting = false;     // at its floor when the substep begins, to rounding
  bool lands = false;          // faster than what rests, when the substep begins
  uint32_t found_in = 0;       // substep of the last FindNormal, from 1
  Real touch;                  // distance at which it touches [m]
  // At the start of the substep: the unit vector from the second primitive to the first, the
  // weights of the particles in the difference of the nearest points, the effective inverse mass
  // [1/kg], and the gap along the normal [m].
  V normal{};
  std::array<Real, 4> weights{};
  Real inverse_mass = 0;
  Real gap = 0;
  Real floor = 0;          // smallest difference along the normal that the end may have [m]
  Real sliding_speed = 0;  // when the substep begins; 0 of what lands [m/s]
  // Accumulated impulses of the substep, as changes of the relative velocity [m/s].
  Real push = 0;
  V tangent{};

  // Before the pair is looked at in a substep.
  void Reset() {
    push = 0;
    tangent = V{};
    has_hit = false;
    lands = false;
    sliding_speed = 0;
  }
};

// The corners of a pair.
template <class V>
inline std::array<V, 4> CornersOf(const ContactPair<V>& pair, const V* positions) {
  return {positions[pair.particles[0]], positions[pair.particles[1]], positions[pair.particles[2]],
          positions[pair.particles[3]]};
}

// The weighted sum of vectors of the particles: the relative velocity of the nearest points, say.
// Differences to the first keep their digits.
template <class V>
inline V Weighted(const ContactPair<V>& pair, const V* vectors) {
  const V first = vectors[pair.particles[0]];
  return pair.weights[1] * (vectors[pair.particles[1]] - first) +
         pair.weights[2] * (vectors[pair.particles[2]] - first) +
         pair.weights[3] * (vectors[pair.particles[3]] - first);
}

// The same of the differences of two vectors of each particle.
template <class V>
inline V WeightedChange(const ContactPair<V>& pair, const V* from, const V* to) {
  V sum{};
  for (int k = 0; k < 4; ++k) {
    const uint32_t i = pair.particles[k];
    sum += pair.weights[k] * (to[i] - from[i]);
  }
  return sum;
}

// Changes the weighted sum of the particles' vectors by `change`, by opposite impulses.
template <class V, class Masses>
inline void Apply(const ContactPair<V>& pair, const V& change, const Masses& inverse_masses,
                  V* vectors) {
  const V impulse = change / pair.inverse_mass;
  for (int k = 0; k < 4; ++k) {
    const uint32_t i = pair.particles[k];
    vectors[i] += (pair.weights[k] * inverse_masses[i]) * impulse;
  }
}

// The impulses on what is held, which it does not follow: sums of a substep [N s], [particle_count]
// each; empty: nobody asks for them.
template <class V>
struct HeldPulls {
  std::span<V> now;        // by changes of velocities
  std::span<V> in_memory;  // by changes of the velocities before the substep, the opposite way
};

// Adds what Apply(pair, change, ...) passes on to held particles.
template <class V, class Masses>
inline void Pull(const ContactPair<V>& pair, const V& change, const Masses& inverse_masses,
                 std::span<V> pulls) {
  if (pulls.empty()) return;
  const V impulse = change / pair.inverse_mass;
  for (int k = 0; k < 4; ++k) {
    const uint32_t i = pair.particles[k];
    if (inverse_masses[i] == 0) pulls[i] += pair.weights[k] * impulse;
  }
}

// Finds the normal, the weights, the inverse mass and the gap at these positions. False: the
// primitives touch or cross, as far as this precision can tell.
template <class V>
bool FindNormal(const V* positions, std::span<const ScalarOf<V>> inverse_masses,
                ContactPair<V>& pair);

// The same of pairs of one kind, at most kPairsSideBySide. Bit k: pair k is apart.
template <class V>
uint32_t FindNormals(const V* positions, std::span<const ScalarOf<V>> inverse_masses, PairKind kind,
                     std::span<ContactPair<V>* const> pairs);

extern template bool FindNormal(const Vector3f*, std::span<const float>, ContactPair<Vector3f>&);
extern template bool FindNormal(const Vector3d*, std::span<const double>, ContactPair<Vector3d>&);

extern template uint32_t FindNormals(const Vector3f*, std::span<const float>, PairKind,
                                     std::span<ContactPair<Vector3f>* const>);
extern template uint32_t FindNormals(const Vector3d*, std::span<const double>, PairKind,
                                     std::span<ContactPair<Vector3d>* const>);

}  // namespace drape::self_contact
