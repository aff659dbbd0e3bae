// The pairs that may touch, in one list for each pair of patches, and when to look at them.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "server/solver/self_contact/contact_pair.h"
#include "server/solver/self_contact/contact_surface.h"
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
  // `guards` only what may come as near as the guard lets it.
  struct Window {
    Real factor = 1, addend = 0;
    bool guards = false;
  };

  // A step begins, without lists. `is_crossing` [particle_count] or empty: pairs of such particles
  // are left alone.
  void Begin(const ContactSurface& surface, const Thicknesses<Real>& thicknesses, Real edge_length,
             const std::vector<bool>& is_crossing, size_t most_pairs);
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
  // are too many pairs.
  bool FindDue(std::span<const V> positions, const Window& window);
  std::span<const DuePair> due() const { return due_; }
  // Of a due pair that has been looked at: whether it may come near in the window.
  bool IsNear(const DuePair& due, const Window& window);
  // All due pairs have been looked at.
  void Close();

  std::span<ContactPair<V>> pairs() { return pairs_; }
  Real way(uint32_t list) const { return lists_[list].way; }

 private:
  struct List {
    PatchPair patches;
    uint32_t begin = 0, end = 0;  // of pairs_
    Real travel = 0;
    Real way = 0;  // of the last substep
    // Travels at which something is due, in windows of either kind, and at which it is used up.
    Real next = std::numeric_limits<Real>::lowest();
    Real next_guarded = std::numeric_limits<Real>::lowest();
    Real valid = std::numeric_limits<Real>::lowest();
    bool is_partial = false;  // lacks the active pairs of this substep
  };
  struct PatchWay {
    V middle, half;
  };

  static Real Reach(const List& list, const Window& window) {
    return window.factor * list.way + window.addend;
  }
  // How much nearer a pair may come than where it touches, before the window has to know of it [m].
  static Real Room(const ContactPair<V>& pair, const Window& window) {
    return window.guards ? static_cast<Real>(1 - kCoreShare) * pair.touch : Real{0};
  }
  void Remake(List& list, Real least_reach);
  void Append(const List& list, const CandidatePair<V>& candidate);
  void Compact();
  void MarkPatches();

  const ContactSurface* surface_ = nullptr;
  Thicknesses<Real> thicknesses_;
  Real edge_length_ = 0;
  const std::vector<bool>* is_crossing_ = nullptr;
  size_t most_pairs_ = 0;
  std::vector<List> lists_, old_lists_;
  std::vector<uint32_t> new_places_;
  std::vector<uint32_t> used_patches_;
  std::vector<bool> is_used_;
  std::vector<PatchWay> patch_ways_;  // [patch_count], of used ones
  std::vector<ContactPair<V>> pairs_, old_pairs_;
  std::vector<Real> wakes_, old_wakes_;  // of each pair: travel of its list at which it is due
  size_t live_pairs_ = 0;                // in lists; the others have been replaced
  std::vector<DuePair> due_;
  std::vector<uint32_t> opened_;
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
  for (List& list : lists_) {
    const PatchWay& a = patch_ways_[list.patches.first];
    const PatchWay& b = patch_ways_[list.patches.second];
    list.way = Length(V(Abs(V(a.middle - b.middle)) + (a.half + b.half)));
  }
}

extern template class ContactLists<Vector3f>;
extern template class ContactLists<Vector3d>;

}  // namespace drape::self_contact
