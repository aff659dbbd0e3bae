// The pairs that may touch, in one list for each pair of patches, and when to look at them.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "server/solver/self_contact/contact_pair.h"
#include "server/solver/self_contact/contact_surface.h"
#include "server/solver/self_contact/filtered_list.h"
#include "server/solver/self_contact/pair_search.h"
#include "server/solver/self_contact/patch_search.h"
#include "server/solver/self_contact/planar_guard.h"

namespace drape::self_contact {

// Two patches come nearer by at most the way of any particle of one relative to any of the other.
// Summed up over substeps this is the travel of their list. What is so far from touching that the
// travel cannot have used it up sleeps: a list until it is made anew, a pair until it is looked at.
// So what is found depends on the states of the step alone. One thread.
template <class V>
class ContactLists {
 public:
  using Real = ScalarOf<V>;

  struct DuePair {
    uint32_t pair;  // in pairs()
    uint32_t list;
  };
  // What to expect of a substep: `factor` times the way of each list, and `addend` [m]. With
  // `guards` only what may come as near as the guard lets it. Lists are of use for `substeps`, this
  // one included.
  struct Window {
    Real factor = 1, addend = 0;
    bool guards = false;
    uint32_t substeps = std::numeric_limits<uint32_t>::max();
  };

  // A step begins, without lists. `is_crossing` [particle_count] or empty: pairs of such particles
  // are left alone. `budget`: that of the substep under way; it outlives the step.
  void Begin(const ContactSurface& surface, const Thicknesses<Real>& thicknesses, Real edge_length,
             const std::vector<bool>& is_crossing, size_t most_pairs, SearchBudget& budget);
  void Clear();
  bool empty() const { return lists_.empty(); }

  // Lists of these pairs of patches, ascending. Those that were there go on, at new places: of each
  // old place the new one, or kGone.
  static constexpr uint32_t kGone = UINT32_MAX;
  std::span<const uint32_t> Replace(std::span<const PatchPair> patches);
  // The ways of the lists, if particle i moves by way_of(i) [m].
  template <class WayOf>
  void MeasureWays(const WayOf& way_of);
  // Ends a substep with the ways last measured.
  void Advance();

  // Makes lists anew that have been used up, and finds the pairs that have to be looked at, none of
  // which is active: due(). The particles are at `positions` when the substep begins. False: there
  // are too many pairs, or the budget is spent.
  bool FindDue(std::span<const V> positions, const Window& window);
  std::span<const DuePair> due() const { return due_.entries(); }
  // Of a due pair that has been looked at, as all have to be: whether it may come near in the
  // window.
  bool IsNear(const DuePair& due, const Window& window);

  std::span<ContactPair<V>> pairs() { return pairs_; }
  Real way(uint32_t list) const { return ways_[list]; }
  Real travel(uint32_t list) const { return travels_[list]; }

 private:
  struct List {
    PatchPair patches;
    uint32_t begin = 0, end = 0;  // of pairs_
    Real valid = kLeast;          // travel at which it is used up
    Real least_room = 0;          // of its pairs, in windows of the guard
    bool is_partial = false;      // lacks the active pairs of this substep
  };
  // One number of each list, padded with lists for which nothing is ever due.
  using Numbers = std::vector<Real>;
  struct PatchWay {
    V middle, half;
  };

  static constexpr Real kMost = std::numeric_limits<Real>::max();
  static constexpr Real kLeast = std::numeric_limits<Real>::lowest();
  static constexpr size_t kSideBySide = 4;  // numbers in a vector

  Real Reach(uint32_t list, const Window& window) const {
    return window.factor * ways_[list] + window.addend;
  }
  // How much nearer a pair may come than where it touches, before the window has to know of it [m].
  static Real Room(const ContactPair<V>& pair, const Window& window) {
    return window.guards ? static_cast<Real>(1 - kCoreShare) * pair.touch : Real{0};
  }
  // A list without pairs at the end of `lists_`.
  void AddList(const PatchPair& patches);
  // Pads the numbers of the lists.
  void Pad();
  // Makes the list anew if need be, and adds what is due in it before the travel `end`.
  void Open(uint32_t list, Real end, const Window& window, std::span<const V> positions);
  void Remake(uint32_t list, Real least_reach, const Window& window);
  void Append(uint32_t list, const CandidatePair<V>& candidate);
  // Makes room for more pairs.
  void Grow();
  // The list is due at this travel, at the latest.
  void WakeAt(uint32_t list, Real travel);
  void Compact();
  void MarkPatches();

  const ContactSurface* surface_ = nullptr;
  Thicknesses<Real> thicknesses_;
  Real edge_length_ = 0;
  const std::vector<bool>* is_crossing_ = nullptr;
  size_t most_pairs_ = 0;
  SearchBudget* budget_ = nullptr;
  std::vector<List> lists_, old_lists_;
  Numbers travels_, ways_;       // the way is that of the last substep
  Numbers next_, next_guarded_;  // travels at which something is due, in windows of either kind
  Numbers old_travels_, old_ways_, old_next_, old_next_guarded_;
  std::vector<uint32_t> new_places_;
  std::vector<uint32_t> used_patches_;
  std::vector<bool> is_used_;
  std::vector<PatchWay> patch_ways_;  // [patch_count], of used ones
  std::vector<ContactPair<V>> pairs_, old_pairs_;
  std::vector<Real> wakes_, old_wakes_;  // of each pair: travel of its list at which it is due
  size_t live_pairs_ = 0;                // in lists; the others have been replaced
  FilteredList<DuePair> due_;
  bool has_begun_ = false;  // search_ knows the state
  PairSearch<V> search_;
  std::vector<CandidatePair<V>> candidates_;
};

template <class V>
template <class WayOf>
void ContactLists<V>::MeasureWays(const WayOf& way_of) {
  for (const uint32_t p : used_patches_) {
    Box<V> box;
    for (const uint32_t i : surface_->corners_of(surface_->patches()[p])) box.Add(way_of(i));
    patch_ways_[p] = {(box.low + box.high) / 2, (box.high - box.low) / 2};
  }
  for (size_t l = 0; l < lists_.size(); ++l) {
    const PatchWay& a = patch_ways_[lists_[l].patches.first];
    const PatchWay& b = patch_ways_[lists_[l].patches.second];
    ways_[l] = Length(V(Abs(V(a.middle - b.middle)) + (a.half + b.half)));
  }
}

extern template class ContactLists<Vector3f>;
extern template class ContactLists<Vector3d>;

}  // namespace drape::self_contact
