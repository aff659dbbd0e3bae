#include "server/solver/self_contact/contact_lists.h"

#include <algorithm>
#include <bit>
#include <cstring>

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
// Neighbours that have no pairs are valid for at most this share of an edge [-]: a crease keeps
// them from being flat, but seldom brings them near. Larger: more pairs whose distance has to be
// found; smaller: such lists are made more often.
constexpr double kFarReach = 0.5;
// No list is made for more than this many times the way that is left if all substeps of the step
// are like this one [-]. Larger: pairs that are of no use; smaller: lists are made again.
constexpr double kUsefulWay = 2;
// So many pairs are copied without a break: some milliseconds.
constexpr size_t kCopiedAtOnce = 16384;

template <class V>
V LoadFour(const ScalarOf<V>* numbers) {
  V four;
  std::memcpy(&four, numbers, sizeof four);
  return four;
}

}  // namespace

template <class V>
void ContactLists<V>::Begin(const ContactSurface& surface, const Thicknesses<Real>& thicknesses,
                            Real edge_length, const std::vector<bool>& is_crossing,
                            size_t most_pairs, SearchBudget& budget) {
  surface_ = &surface;
  thicknesses_ = thicknesses;
  edge_length_ = edge_length;
  is_crossing_ = &is_crossing;
  most_pairs_ = most_pairs;
  budget_ = &budget;
  patch_ways_.resize(surface.patches().size());
  Clear();
}

template <class V>
void ContactLists<V>::Clear() {
  lists_.clear();
  for (Numbers* numbers : {&travels_, &ways_, &next_, &next_guarded_}) numbers->clear();
  pairs_.clear();
  wakes_.clear();
  due_.clear();
  live_pairs_ = 0;
}

template <class V>
void ContactLists<V>::AddList(const PatchPair& patches) {
  lists_.push_back(List{.patches = patches});
  travels_.push_back(0);
  ways_.push_back(0);
  next_.push_back(kLeast);
  next_guarded_.push_back(kLeast);
}

template <class V>
void ContactLists<V>::Pad() {
  const size_t size = (lists_.size() + kSideBySide - 1) / kSideBySide * kSideBySide;
  for (Numbers* numbers : {&travels_, &ways_}) numbers->resize(size, 0);
  for (Numbers* numbers : {&next_, &next_guarded_}) numbers->resize(size, kMost);
}

template <class V>
std::span<const uint32_t> ContactLists<V>::Replace(std::span<const PatchPair> patches) {
  lists_.swap(old_lists_);
  travels_.swap(old_travels_);
  ways_.swap(old_ways_);
  next_.swap(old_next_);
  next_guarded_.swap(old_next_guarded_);
  lists_.clear();
  for (Numbers* numbers : {&travels_, &ways_, &next_, &next_guarded_}) numbers->clear();
  new_places_.assign(old_lists_.size(), kGone);
  live_pairs_ = 0;
  size_t old = 0;
  for (const PatchPair& pair : patches) {
    while (old < old_lists_.size() && old_lists_[old].patches < pair) ++old;
    const auto place = static_cast<uint32_t>(lists_.size());
    AddList(pair);
    if (old == old_lists_.size() || old_lists_[old].patches != pair) continue;
    new_places_[old] = place;
    live_pairs_ += old_lists_[old].end - old_lists_[old].begin;
    lists_[place] = old_lists_[old];
    travels_[place] = old_travels_[old];
    ways_[place] = old_ways_[old];
    next_[place] = old_next_[old];
    next_guarded_[place] = old_next_guarded_[old];
  }
  Pad();
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
  for (size_t l = 0; l < lists_.size(); ++l) travels_[l] += ways_[l];
}

template <class V>
bool ContactLists<V>::FindDue(std::span<const V> positions, const Window& window) {
  due_.clear();
  has_begun_ = false;
  if (!window.guards && pairs_.size() > 2 * live_pairs_ + 1024) Compact();
  const Numbers& next = window.guards ? next_guarded_ : next_;
  for (size_t begin = 0; begin < lists_.size(); begin += kSideBySide) {
    const V ends = LoadFour<V>(&travels_[begin]) +
                   (window.factor * LoadFour<V>(&ways_[begin]) + window.addend);
    for (uint32_t bits = BitsOf(ends >= LoadFour<V>(&next[begin])); bits != 0; bits &= bits - 1) {
      const int lane = std::countr_zero(bits);
      Open(static_cast<uint32_t>(begin) + static_cast<uint32_t>(lane), ends[lane], window,
           positions);
      if (live_pairs_ > most_pairs_ || budget_->is_spent()) {
        // Nobody will look at what was due: all lists are opened again when there is room.
        for (Numbers* numbers : {&next_, &next_guarded_}) {
          std::fill_n(numbers->begin(), lists_.size(), kLeast);
        }
        return false;
      }
    }
  }
  return true;
}

template <class V>
void ContactLists<V>::Open(uint32_t l, Real end, const Window& window,
                           std::span<const V> positions) {
  List& list = lists_[l];
  if (end >= list.valid || (list.is_partial && !window.guards)) {
    if (!has_begun_) search_.Begin(*surface_, positions, thicknesses_, *budget_);
    has_begun_ = true;
    Remake(l, end - travels_[l], window);
  }
  Real next = list.valid;
  due_.Reserve(list.end - list.begin);
  if (window.guards) {
    for (uint32_t k = list.begin; k < list.end; ++k) {
      const bool is_due = wakes_[k] + Room(pairs_[k], window) <= end && !pairs_[k].is_active;
      due_.Offer({k, l}, is_due);
      next = std::min(next, is_due ? kMost : wakes_[k]);
    }
  } else {  // nothing is active yet
    for (uint32_t k = list.begin; k < list.end; ++k) {
      const bool is_due = wakes_[k] <= end;
      due_.Offer({k, l}, is_due);
      next = std::min(next, is_due ? kMost : wakes_[k]);
    }
  }
  next_[l] = list.is_partial ? kLeast : next;
  next_guarded_[l] = std::min(list.valid, next + list.least_room);
}

template <class V>
void ContactLists<V>::WakeAt(uint32_t list, Real travel) {
  next_[list] = std::min(next_[list], travel);
  next_guarded_[list] = std::min(next_guarded_[list], travel + lists_[list].least_room);
}

template <class V>
void ContactLists<V>::Remake(uint32_t l, Real least_reach, const Window& window) {
  List& list = lists_[l];
  live_pairs_ -= list.end - list.begin;
  const auto [first, second] = list.patches;
  const Real thickness = thicknesses_.Of(*surface_, first, second);
  const Real useful = static_cast<Real>(kUsefulWay) * (ways_[l] + window.addend) *
                      static_cast<Real>(window.substeps);
  const Real wanted = std::max(std::min(static_cast<Real>(kReachSubsteps) * ways_[l],
                                        static_cast<Real>(kMaxReach) * edge_length_),
                               static_cast<Real>(kMinReach) * thickness);
  const Real least = static_cast<Real>(kReachMargin) * least_reach;
  const Real reach = std::max(std::min(wanted, useful), least);
  const uint32_t old_begin = list.begin, old_end = list.end;
  const bool is_far = old_begin == old_end && surface_->AreNeighbours(first, second);
  list.begin = list.end = static_cast<uint32_t>(pairs_.size());
  list.is_partial = false;
  list.least_room = kMost;
  const Real gap = search_.Gap(list.patches) - thickness;
  if (gap > reach) {
    list.valid = travels_[l] + gap;
    return;
  }
  candidates_.clear();
  const Real far = is_far ? std::min(static_cast<Real>(kFarReach) * edge_length_, useful) : 0;
  list.valid = travels_[l] + search_.Find(list.patches, reach, candidates_, far);
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
    if (!is_active) Append(l, candidate);
  }
  list.end = static_cast<uint32_t>(pairs_.size());
  live_pairs_ += list.end - list.begin;
}

template <class V>
void ContactLists<V>::Append(uint32_t list, const CandidatePair<V>& candidate) {
  if (pairs_.size() == pairs_.capacity()) Grow();
  ContactPair<V>& pair = pairs_.emplace_back();
  pair.particles = candidate.particles;
  pair.kind = candidate.kind;
  pair.touch = candidate.touch;
  pair.is_left_alone =
      !is_crossing_->empty() && std::all_of(candidate.particles.begin(), candidate.particles.end(),
                                            [&](uint32_t i) { return (*is_crossing_)[i]; });
  wakes_.push_back(travels_[list] + std::max(candidate.distance - candidate.touch, Real{0}));
  lists_[list].least_room = std::min(lists_[list].least_room, Room(pair, {.guards = true}));
}

template <class V>
void ContactLists<V>::Grow() {
  std::vector<ContactPair<V>> larger;
  larger.reserve(2 * pairs_.size() + 64);
  for (size_t begin = 0; begin < pairs_.size(); begin += kCopiedAtOnce) {
    const auto first = pairs_.begin() + static_cast<std::ptrdiff_t>(begin);
    larger.insert(
        larger.end(), first,
        first + static_cast<std::ptrdiff_t>(std::min(kCopiedAtOnce, pairs_.size() - begin)));
    if (begin > 0) budget_->Check();
  }
  pairs_.swap(larger);
}

template <class V>
bool ContactLists<V>::IsNear(const DuePair& due, const Window& window) {
  const ContactPair<V>& pair = pairs_[due.pair];
  const Real wake = travels_[due.list] + std::max(pair.gap - pair.touch, Real{0});
  wakes_[due.pair] = wake;
  WakeAt(due.list, wake);
  return wake + Room(pair, window) <= travels_[due.list] + Reach(due.list, window);
}

// In the order of the lists.
template <class V>
void ContactLists<V>::Compact() {
  pairs_.swap(old_pairs_);
  wakes_.swap(old_wakes_);
  pairs_.clear();
  wakes_.clear();
  pairs_.reserve(live_pairs_);
  wakes_.reserve(live_pairs_);
  size_t next_check = kCopiedAtOnce;
  for (List& list : lists_) {
    const auto begin = static_cast<uint32_t>(pairs_.size());
    if (begin >= next_check) {
      next_check = begin + kCopiedAtOnce;
      budget_->Check();
    }
    for (uint32_t k = list.begin; k < list.end; ++k) {
      pairs_.push_back(old_pairs_[k]);
      wakes_.push_back(old_wakes_[k]);
    }
    list.begin = begin;
    list.end = static_cast<uint32_t>(pairs_.size());
  }
  if (old_pairs_.size() > kCopiedAtOnce) old_pairs_ = {};
}

template class ContactLists<Vector3f>;
template class ContactLists<Vector3d>;

}  // namespace drape::self_contact
