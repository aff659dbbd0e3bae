// Finds the pairs of patches whose primitives may come near each other within some time.
#pragma once

#include <compare>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "server/solver/self_contact/contact_surface.h"
#include "server/solver/self_contact/patch_shape.h"
#include "server/solver/self_contact/search_budget.h"
#include "server/solver/self_contact/vectors.h"

namespace drape::self_contact {

// first <= second; a patch may also be near itself.
struct PatchPair {
  uint32_t first, second;

  auto operator<=>(const PatchPair&) const = default;
};

// The state in which to search, and how it goes on: within `duration` no particle is farther than
// `drift` from where its velocity takes it, relative to any other particle.
template <class V>
struct SearchState {
  std::span<const V> positions;   // [particle_count] [m]
  std::span<const V> velocities;  // [particle_count] [m/s]
  ScalarOf<V> duration = 0;       // [s]
  ScalarOf<V> drift = 0;          // [m]
};

// Every pair of a small cloth, 128 per patch of a large one, 2^23 of any.
size_t MostPatchPairs(const ContactSurface& surface);

// Working memory between searches; a search depends on its arguments alone. One thread.
template <class V>
class PatchSearch {
 public:
  using Real = ScalarOf<V>;

  // Every pair of patches with primitives without a common vertex that may be nearer than
  // `thickness` at some time of `state`. `pairs` is replaced, ascending. False: there are more than
  // MostPatchPairs, or the budget is spent, and only some are there, in no order; where everything
  // is in one place, all pairs of a large cloth would fill the memory.
  bool Find(const ContactSurface& surface, const SearchState<V>& state, Real thickness,
            SearchBudget& budget, std::vector<PatchPair>& pairs);
  // By how much two patches of the last search may come nearer within its time, drift apart [m].
  Real Approach(const PatchPair& pair) const {
    return Length(Approach(patches_[pair.first].velocities, patches_[pair.second].velocities));
  }

 private:
  struct NodeState {
    Box<V> positions;
    Box<V> velocities;
  };

  void Prepare(SearchBudget& budget);
  void SearchTree(SearchBudget& budget);
  void SearchNeighbours();
  // By how much two sets of particles may come nearer as their velocities take them, along each
  // axis.
  V Approach(const Box<V>& velocities, const Box<V>& other_velocities) const;
  void Sort();

  // Of the search under way.
  const ContactSurface* surface_ = nullptr;
  SearchState<V> state_;
  Real thickness_ = 0;
  std::vector<PatchPair>* pairs_ = nullptr;
  size_t most_pairs_ = 0;
  std::vector<PatchShape<V>> shapes_, surroundings_;  // of each patch
  std::vector<NodeState> patches_, nodes_;
  std::vector<std::pair<uint32_t, uint32_t>> open_;
  std::vector<uint32_t> offsets_;
  std::vector<PatchPair> sorted_;
};

extern template class PatchSearch<Vector3f>;
extern template class PatchSearch<Vector3d>;

}  // namespace drape::self_contact
