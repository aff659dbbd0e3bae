#include "server/solver/self_contact/contact_lists.h"

#include <algorithm>

namespace drape::self_contact {
namespace {

// A list holds what comes near within this many substeps like the last one [-], but at most within
// kMaxReach of an edge [-], and at least within kMinReach of the thickness [-] and kReachMargin of
// what the substep needs [-]. Larger: more pairs than ever touch; smaller: lists are made more
// often.
constexpr double kReachSubsteps = 12;
constexpr double kReachMargin = 1.05;
constexpr double kMinReach = 0.2;
constexpr double kMaxReach = 0.2;

}  // namespace

template <class V>
void ContactLists<V>::Begin(const ContactSurface& surface, const Thicknesses<Real>& thicknesses,
                            Real edge_length, const std::vector<bool>& is_crossing,
                            size_t most_pairs) {
  surface_ = &surface;
  thicknesses_ = thicknesses;
  edge_length_ = edge_length;
  is_crossing_ = &is_crossing;
  most_pairs_ = most_pairs;
  patch_ways_.resize(surface.patches().size());
  Clear();
}

template <class V>
void ContactLists<V>::Clear() {
  lists_.clear();
  pairs_.clear();
  wakes_.clear();
  due_.clear();
  live_pairs_ = 0;
}

template <class V>
std::span<const uint32_t> ContactLists<V>::Replace(std::span<const PatchPair> patches) {
  lists_.swap(old_lists_);
  lists_.clear();
  new_places_.assign(old_lists_.size(), kGone);
  live_pairs_ = 0;
  size_t old = 0;
  for (const PatchPair& pair : patches) {
    while (old < old_lists_.size() && old_lists_[old].patches < pair) ++old;
    if (old < old_lists_.size() && old_lists_[old].patches == pair) {
      new_places_[old] = static_cast<uint32_t>(lists_.size());
      live_pairs_ += old_lists_[old].end - old_lists_[old].begin;
      lists_.push_back(old_lists_[old]);
      continue;
    }
    lists_.push_back(List{.patches = pair});
  }
  MarkPatches();
  return new_places_;
}

template <class V>
void ContactLists<V>::MarkPatches() {
  used_patches_.clear();
  is_used_.assign(surface_->patches().size(), false);
  for (const List& list : lists_) {
    for (const uint32_t p : {list.patches.first, list.patches.second}) {
      if (!is_used_[p]) used_patches_.push_back(p);
      is_used_[p] = true;
    }
  }
}

template <class V>
void ContactLists<V>::Advance() {
  for (List& list : lists_) list.travel += list.way;
}

template <class V>
bool ContactLists<V>::FindDue(std::span<const V> positions, const Window& window) {
  due_.clear();
  opened_.clear();
  if (!window.guards && pairs_.size() > 2 * live_pairs_ + 1024) Compact();
  bool has_begun = false;
  for (uint32_t l = 0; l < lists_.size(); ++l) {
    List& list = lists_[l];
    const Real end = list.travel + Reach(list, window);
    if (end < (window.guards ? list.next_guarded : list.next)) continue;
    opened_.push_back(l);
    if (end >= list.valid || (list.is_partial && !window.guards)) {
      if (!has_begun) search_.Begin(*surface_, positions, thicknesses_);
      has_begun = true;
      Remake(list, end - list.travel);
      if (live_pairs_ > most_pairs_) return false;
    }
    for (uint32_t k = list.begin; k < list.end; ++k) {
      if (wakes_[k] > end || pairs_[k].is_active) continue;
      if (wakes_[k] + Room(pairs_[k], window) <= end) due_.push_back({k, l});
    }
  }
  return true;
}

template <class V>
void ContactLists<V>::Remake(List& list, Real least_reach) {
  live_pairs_ -= list.end - list.begin;
  const auto [first, second] = list.patches;
  const Real thickness = thicknesses_.Of(*surface_, first, second);
  const Real reach = std::max({std::min(static_cast<Real>(kReachSubsteps) * list.way,
                                        static_cast<Real>(kMaxReach) * edge_length_),
                               static_cast<Real>(kMinReach) * thickness,
                               static_cast<Real>(kReachMargin) * least_reach});
  const uint32_t old_begin = list.begin, old_end = list.end;
  list.begin = list.end = static_cast<uint32_t>(pairs_.size());
  list.is_partial = false;
  const Real gap = search_.Gap(list.patches) - thickness;
  if (gap > reach) {
    list.valid = list.travel + gap;
    return;
  }
  list.valid = list.travel + reach;
  candidates_.clear();
  search_.Find(list.patches, reach, candidates_);
  for (uint32_t k = old_begin; k < old_end; ++k) list.is_partial |= pairs_[k].is_active;
  for (const CandidatePair<V>& candidate : candidates_) {
    const auto is_same = [&](uint32_t k) {
      return pairs_[k].is_active && pairs_[k].kind == candidate.kind &&
             pairs_[k].particles == candidate.particles;
    };
    bool is_active = false;
    if (list.is_partial) {
      for (uint32_t k = old_begin; k < old_end; ++k) is_active |= is_same(k);
    }
    if (!is_active) Append(list, candidate);
  }
  list.end = static_cast<uint32_t>(pairs_.size());
  live_pairs_ += list.end - list.begin;
}

template <class V>
void ContactLists<V>::Append(const List& list, const CandidatePair<V>& candidate) {
  ContactPair<V>& pair = pairs_.emplace_back();
  pair.particles = candidate.particles;
  pair.kind = candidate.kind;
  pair.touch = candidate.touch;
  pair.is_left_alone =
      !is_crossing_->empty() && std::all_of(candidate.particles.begin(), candidate.particles.end(),
                                            [&](uint32_t i) { return (*is_crossing_)[i]; });
  wakes_.push_back(list.travel + std::max(candidate.distance - candidate.touch, Real{0}));
}

template <class V>
bool ContactLists<V>::IsNear(const DuePair& due, const Window& window) {
  const List& list = lists_[due.list];
  const ContactPair<V>& pair = pairs_[due.pair];
  wakes_[due.pair] = list.travel + std::max(pair.gap - pair.touch, Real{0});
  return wakes_[due.pair] + Room(pair, window) <= list.travel + Reach(list, window);
}

template <class V>
void ContactLists<V>::Close() {
  for (const uint32_t l : opened_) {
    List& list = lists_[l];
    list.next = list.next_guarded = list.valid;
    for (uint32_t k = list.begin; k < list.end; ++k) {
      list.next = std::min(list.next, wakes_[k]);
      if (pairs_[k].is_active) continue;
      list.next_guarded =
          std::min(list.next_guarded, wakes_[k] + Room(pairs_[k], {.guards = true}));
    }
    if (list.is_partial) list.next = std::numeric_limits<Real>::lowest();
  }
}

// In the order of the lists.
template <class V>
void ContactLists<V>::Compact() {
  pairs_.swap(old_pairs_);
  wakes_.swap(old_wakes_);
  pairs_.clear();
  wakes_.clear();
  for (List& list : lists_) {
    const auto begin = static_cast<uint32_t>(pairs_.size());
    for (uint32_t k = list.begin; k < list.end; ++k) {
      pairs_.push_back(old_pairs_[k]);
      wakes_.push_back(old_wakes_[k]);
    }
    list.begin = begin;
    list.end = static_cast<uint32_t>(pairs_.size());
  }
}

template class ContactLists<Vector3f>;
template class ContactLists<Vector3d>;

}  // namespace drape::self_contact
