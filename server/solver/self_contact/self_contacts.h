// The contacts of cloths with themselves and with each other during a step: the stages
// find_self_contacts, solve_self_contacts and guard_self_contacts of server/solver/method.md, in
// single or double precision.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/solver/self_contact/contact_lists.h"
#include "server/solver/self_contact/contact_pair.h"
#include "server/solver/self_contact/contact_surface.h"
#include "server/solver/self_contact/pair_impulses.h"
#include "server/solver/self_contact/pair_search.h"
#include "server/solver/self_contact/patch_search.h"
#include "server/solver/self_contact/planar_guard.h"
#include "server/solver/self_contact/step_numbers.h"

namespace drape::self_contact {

// Where a pair has moved the predicted nearest points by more than this share of an edge in the
// last sweep of a substep [-], kHitSweeps more follow: nothing else would tell the links before the
// next substep. Larger: cloth is strained where layers hit each other; smaller: time.
inline constexpr double kHardHit = 1e-2;
inline constexpr uint32_t kHitSweeps = 2;

// Where there are more pairs, all particles move alike.
inline size_t MostPairs(size_t particles) {
  constexpr size_t kPerParticle = 200;
  // Of cloths above 42 000 particles: MostBytes.
  constexpr size_t kInAll = size_t{1} << 23;
  return std::min(kPerParticle * particles, kInAll);
}

// What pairs take in a step at most, and about [bytes]: those that lists have, as many that they no
// longer have, and the copy of some while there are ever more
// (tests/bench/notes/self_contact.md).
template <class V>
uint64_t MostBytes(size_t particles) {
  return 5 * sizeof(ContactPair<V>) * MostPairs(particles) / 2;
}

// Working memory between steps; a step depends on its arguments alone. One thread.
template <class V>
class SelfContacts {
 public:
  using Real = ScalarOf<V>;

  // Begins a step. `may_cross`: parts of the cloth may cross each other at these positions; those
  // that do are left alone. Whether any does.
  bool Begin(const ContactSurface& surface, const StepNumbers<V>& numbers, bool may_cross,
             std::span<const V> positions);

  // What is expected of a step in which nothing can touch, as long as no particle is farther from
  // where its velocity takes it than `drift`, relative to any other, at the end of any substep.
  struct Expectation {
    std::span<const V> velocities;  // [particle_count] [m/s]
    Real drift;                     // [m]
    Real substep_s;                 // [s]
  };
  // Of a step that begins here, in which nothing crosses; none: something may touch. Nothing else
  // needs to be done in a step that keeps to it: no other function would change anything.
  std::optional<Expectation> ExpectNothing(const ContactSurface& surface,
                                           const StepNumbers<V>& numbers,
                                           std::span<const V> positions,
                                           std::span<const V> velocities);
  // Whether the step under way, or the last one, has kept to such an expectation.
  bool has_found_nothing() const { return has_found_nothing_; }

  // Begins a substep from this state.
  void Find(std::span<const V> positions, std::span<const V> velocities);
  // One sweep over the pairs; the particles are predicted at base + interval u, from `starts`.
  // Whether a velocity changed by more than `least_change` [m/s].
  bool Solve(const V* starts, const V* base, V* u, Real interval, Real least_change);
  // How many sweeps a substep may have in all that asks for so many, after the last Solve.
  uint32_t SweepsOf(uint32_t asked) const {
    return hardest_hit_ > static_cast<Real>(kHardHit) * numbers_.edge_length ? asked + kHitSweeps
                                                                             : asked;
  }
  // Ends the substep. No pair passes through itself, and what touches has no velocity towards or
  // from the other side. False: pins forced a pair through itself, or the state is not finite.
  bool Guard(const typename PlanarGuard<V>::Motion& motion);

  // Of particles of edges and triangles that crossed when the step began; empty: none did.
  const std::vector<bool>& is_crossing() const { return is_crossing_; }
  // Whether all particles have moved alike in some substep of the step, since contacts were too
  // many or searches found no end.
  bool has_given_up() const { return has_given_up_; }
  // Of the substep, those that were near.
  std::span<const uint32_t> active() const { return active_; }

 private:
  using Window = typename ContactLists<V>::Window;

  std::span<const V> Smoothed(std::span<const V> velocities);
  // Pairs of patches, for at most so many substeps.
  void Search(std::span<const V> positions, std::span<const V> velocities, uint32_t most_substeps);
  bool FindPatches(uint32_t substeps);
  bool IsFlat(Real duration) const;
  // Drops pairs of patches that turn out to be too far apart for the time of the search.
  void DropFarPatches();
  // Makes pairs active that may touch within the window. Whether there were any.
  bool Wake(std::span<const V> starts, const Window& window);
  // Of the pairs that are due.
  void LookAtDue(std::span<const V> starts);
  void FindNormalsOf(PairKind kind, std::span<const V> starts);
  bool GuardFar(const typename PlanarGuard<V>::Motion& motion);

  const ContactSurface* surface_ = nullptr;
  StepNumbers<V> numbers_;
  Real substep_s_ = 0;
  uint32_t substep_ = 0;           // the one under way, from 1
  std::vector<bool> is_crossing_;  // of particles of edges and triangles that crossed; or empty
  SearchBudget budget_{0};         // what the substep may still look at
  PatchSearch<V> search_;
  PairSearch<V> pair_search_;
  std::vector<CandidatePair<V>> near_pairs_;
  std::vector<PatchPair> patch_pairs_;
  ContactLists<V> lists_;
  PairImpulses<V> impulses_;
  std::vector<uint32_t> active_;        // pairs of the substep
  std::vector<uint32_t> active_lists_;  // of each of them
  std::vector<Real> active_ways_;
  std::vector<V> start_velocities_;  // of the substep, where pairs are active and rub
  std::vector<uint32_t> landed_;     // pairs of the substep
  std::array<std::vector<ContactPair<V>*>, 2> turned_;  // by kind: those that need a new normal
  Real hardest_hit_ = 0;          // largest change of a predicted difference in the last sweep [m]
  uint32_t normal_substeps_ = 1;  // for which a normal is used
  // Of the last search; none yet: no substeps left.
  std::vector<V> found_positions_, found_velocities_;
  uint32_t substeps_left_ = 0;  // that it is for
  Real since_search_ = 0;       // [s] at the start of the substep
  bool has_found_nothing_ = false;
  bool has_all_patches_ = true;
  bool has_all_pairs_ = true;
  bool has_given_up_ = false;
  int given_up_ = 0;  // substeps, one after the other, of which not all pairs were found
  Real drift_scale_ = 1;
  Real drift_ = 0;  // that it allows for [m]
  std::vector<V> smoothed_, ways_;
  std::vector<Real> degrees_;
  PlanarGuard<V> guard_;
};

extern template class SelfContacts<Vector3f>;
extern template class SelfContacts<Vector3d>;

}  // namespace drape::self_contact
