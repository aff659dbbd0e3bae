#include "server/solver/self_contact/self_contacts.h"

#include <algorithm>
#include <cmath>

#include "server/solver/self_contact/crossing_search.h"
#include "server/solver/self_contact/drift.h"
#include "shaders/interface/self_contact_search.h"

namespace drape::self_contact {
namespace {

constexpr double kSearchWay = DRAPE_CONTACT_SEARCH_WAY;
constexpr double kLongestSearch_s = DRAPE_CONTACT_LONGEST_SEARCH;
constexpr double kDriftThickness = DRAPE_CONTACT_DRIFT_THICKNESS;
constexpr double kDriftEdge = DRAPE_CONTACT_DRIFT_EDGE;
constexpr double kDriftFall = DRAPE_CONTACT_DRIFT_FALL;
// In a step in which particles drift farther than a search allows for, the next searches allow for
// this many times more each, and at most for so many times as much [-].
constexpr double kDriftGrowth = 2;
constexpr double kMaxDriftScale = 8;
// The way of a substep is expected to be this many times that of the one before [-]. Larger: more
// pairs are looked at; smaller: pairs are found too late for impulses, and the guard has to push.
constexpr double kWayMargin = 1.25;
// A search of which the fastest particles would use up the way within a step is first tried for the
// whole step, if they do so at most this many times [-]. Larger: searches in vain where something
// touches; smaller: cloth that swings fast is looked at several times.
constexpr double kWholeStep = 4;
// Pairs of patches, for each patch, of which a search looks whether they are near after all [-].
// Larger: takes longer where something touches; smaller: waves cost what contacts do.
constexpr double kMostLookedAt = 1;
// Normals are found again after this time [s], or sooner where a pair comes near.
constexpr double kNormalAge_s = 1.0 / 800;
// Searches within one substep that pushes have led too far before all particles move alike [-].
constexpr int kMostSearches = 4;
constexpr int kMostGivenUp = DRAPE_CONTACT_MOST_GIVEN_UP;

}  // namespace

template <class V>
bool SelfContacts<V>::Begin(const ContactSurface& surface, const StepNumbers<V>& numbers,
                            bool may_cross, std::span<const V> positions) {
  surface_ = &surface;
  numbers_ = numbers;
  substep_s_ = numbers.time_step / static_cast<Real>(numbers.substeps);
  substep_ = 0;
  substeps_left_ = 0;
  drift_scale_ = 1;
  has_found_nothing_ = true;
  given_up_ = 0;
  has_given_up_ = false;
  is_crossing_.clear();
  active_.clear();
  active_lists_.clear();
  impulses_.Begin(surface, numbers_);
  lists_.Begin(surface, numbers.thicknesses, numbers.edge_length, is_crossing_,
               MostPairs(surface.particle_count()), budget_);
  normal_substeps_ = 1 + static_cast<uint32_t>(static_cast<Real>(kNormalAge_s) / substep_s_);
  if (!may_cross) return false;
  std::vector<Vector3d> exact;
  for (const V& p : positions)
    exact.push_back(Vector3d{double{p[0]}, double{p[1]}, double{p[2]}, 0});
  is_crossing_ = FlagCrossings(surface, exact, numbers.interruption);
  return !is_crossing_.empty();
}

template <class V>
std::optional<typename SelfContacts<V>::Expectation> SelfContacts<V>::ExpectNothing(
    const ContactSurface& surface, const StepNumbers<V>& numbers, std::span<const V> positions,
    std::span<const V> velocities) {
  Begin(surface, numbers, false, positions);
  substep_ = 1;
  budget_ = SubstepBudget(surface, numbers.interruption);
  Search(positions, Smoothed(velocities), numbers.substeps);
  if (!has_found_nothing_) return std::nullopt;
  return Expectation{found_velocities_, drift_, substep_s_};
}

template <class V>
void SelfContacts<V>::Find(std::span<const V> positions, std::span<const V> velocities) {
  ++substep_;
  budget_ = SubstepBudget(*surface_, numbers_.interruption);
  hardest_hit_ = 0;
  for (const uint32_t k : active_) lists_.pairs()[k].is_active = false;
  active_.clear();
  active_lists_.clear();
  const bool has_searched = substeps_left_ == 0;
  if (has_searched) {
    Search(positions, Smoothed(velocities), numbers_.substeps);
  } else {
    since_search_ += substep_s_;
  }
  --substeps_left_;
  if (lists_.empty()) return;
  if (has_searched) lists_.MeasureWays([&](uint32_t i) { return V(substep_s_ * velocities[i]); });
  Wake(positions, {.factor = static_cast<Real>(kWayMargin),
                   .addend = numbers_.gravity * substep_s_ * substep_s_,
                   .substeps = numbers_.substeps - substep_ + 1});
  if (!active_.empty()) impulses_.BeginSubstep(substep_, velocities);
}

// Neighbours that flutter against each other stay where they are: the mean over them tells better
// where they will be than a velocity does.
template <class V>
std::span<const V> SelfContacts<V>::Smoothed(std::span<const V> velocities) {
  const size_t count = surface_->particle_count();
  smoothed_.assign(velocities.begin(), velocities.begin() + static_cast<std::ptrdiff_t>(count));
  degrees_.assign(count, 1);
  for (const auto& [i, j] : surface_->edges()) {
    smoothed_[i] += velocities[j];
    smoothed_[j] += velocities[i];
    degrees_[i] += 1;
    degrees_[j] += 1;
  }
  for (size_t i = 0; i < count; ++i) smoothed_[i] /= degrees_[i];
  return smoothed_;
}

template <class V>
void SelfContacts<V>::Search(std::span<const V> positions, std::span<const V> velocities,
                             uint32_t most_substeps) {
  const size_t count = surface_->particle_count();
  found_positions_.assign(positions.begin(),
                          positions.begin() + static_cast<std::ptrdiff_t>(count));
  found_velocities_.assign(velocities.begin(),
                           velocities.begin() + static_cast<std::ptrdiff_t>(count));
  Box<V> speeds;
  for (const V& v : found_velocities_) speeds.Add(v);
  const Real speed = Length(V(speeds.high - speeds.low)) / 2;
  const Real longest = std::min(static_cast<Real>(kLongestSearch_s),
                                static_cast<Real>(kSearchWay) * numbers_.edge_length /
                                    std::max(speed, std::numeric_limits<Real>::min()));
  const uint32_t rest = std::min(numbers_.substeps - substep_ + 1, most_substeps);
  const Real wanted = std::min(longest / substep_s_, static_cast<Real>(rest));
  const uint32_t planned = std::max(1u, static_cast<uint32_t>(wanted));
  since_search_ = 0;
  if (given_up_ == kMostGivenUp) {
    substeps_left_ = rest;
    has_all_patches_ = has_all_pairs_ = false;
    return;
  }
  // Where nothing touches in the whole step there is nothing else to do in it.
  const bool tries_all = rest == numbers_.substeps &&
                         wanted * static_cast<Real>(kWholeStep) >= static_cast<Real>(rest);
  const bool finds_nothing = tries_all && FindPatches(rest);
  if (!finds_nothing && !(tries_all && planned == rest)) FindPatches(planned);
  has_found_nothing_ &= has_all_patches_ && patch_pairs_.empty() && substeps_left_ == rest;
  if (!has_all_patches_) patch_pairs_.clear();
  const std::span<const uint32_t> places = lists_.Replace(patch_pairs_);
  for (uint32_t& list : active_lists_) {
    if (list != ContactLists<V>::kGone) list = places[list];
  }
  has_all_pairs_ = has_all_patches_;
}

// For so many substeps. Whether there are none.
template <class V>
bool SelfContacts<V>::FindPatches(uint32_t substeps) {
  substeps_left_ = substeps;
  const Real duration = static_cast<Real>(substeps) * substep_s_;
  drift_ =
      drift_scale_ * (static_cast<Real>(kDriftThickness) * numbers_.thicknesses.most +
                      static_cast<Real>(kDriftEdge) * numbers_.edge_length +
                      static_cast<Real>(kDriftFall / 2) * numbers_.gravity * duration * duration);
  if (IsFlat(duration)) {
    patch_pairs_.clear();
    has_all_patches_ = true;
    return true;
  }
  has_all_patches_ =
      search_.Find(*surface_, {found_positions_, found_velocities_, duration, drift_},
                   numbers_.thicknesses.most, budget_, patch_pairs_);
  if (has_all_patches_ && substeps == numbers_.substeps) DropFarPatches();
  return has_all_patches_ && patch_pairs_.empty();
}

// Whether the cloth is a sheet that lies so flat that nothing of it comes near anything in this
// time.
template <class V>
bool SelfContacts<V>::IsFlat(Real duration) const {
  const std::optional<FlatSheet>& sheet = surface_->flat_sheet();
  if (!sheet) return false;
  const Real share = (numbers_.thicknesses.most + drift_) / static_cast<Real>(sheet->least_gap_m());
  return sheet->KeepsApart<V>(found_positions_, found_velocities_, duration, share);
}

// Neighbours in waves are not flat, and yet far from each other. Where there are few such pairs,
// and the search is for the whole step, they are worth a look: without any the step is over.
template <class V>
void SelfContacts<V>::DropFarPatches() {
  const auto most =
      static_cast<size_t>(kMostLookedAt * static_cast<double>(surface_->patches().size()));
  if (patch_pairs_.empty() || patch_pairs_.size() > most) return;
  pair_search_.Begin(*surface_, found_positions_, numbers_.thicknesses, budget_);
  std::erase_if(patch_pairs_, [&](const PatchPair& pair) {
    const Real reach = drift_ + search_.Approach(pair);
    const Real thickness = numbers_.thicknesses.Of(*surface_, pair.first, pair.second);
    if (pair_search_.Gap(pair) > thickness + reach) return true;
    near_pairs_.clear();
    return pair_search_.Find(pair, 0, near_pairs_, reach) >= reach && near_pairs_.empty();
  });
}

template <class V>
bool SelfContacts<V>::Wake(std::span<const V> starts, const Window& window) {
  const size_t before = active_.size();
  has_all_pairs_ = has_all_patches_ && lists_.FindDue(starts, window);
  if (!has_all_pairs_) return false;
  const std::span<ContactPair<V>> pairs = lists_.pairs();
  LookAtDue(starts);
  for (const auto& due : lists_.due()) {
    if (!lists_.IsNear(due, window)) continue;
    pairs[due.pair].is_active = true;
    active_.push_back(due.pair);
    active_lists_.push_back(due.list);
  }
  return active_.size() > before;
}

// The gap along any direction bounds the distance, so an old normal will do for a while.
template <class V>
void SelfContacts<V>::LookAtDue(std::span<const V> starts) {
  for (auto& pairs : turned_) pairs.clear();
  for (const auto& due : lists_.due()) {
    ContactPair<V>& pair = lists_.pairs()[due.pair];
    pair.Reset();
    if (pair.is_left_alone) continue;
    if (pair.found_in > 0 && substep_ < pair.found_in + normal_substeps_) {
      pair.gap = GapAlong(pair.kind, CornersOf(pair, starts.data()), pair.normal);
      if (pair.gap > pair.touch / 2) {
        impulses_.BeginPair(pair, true, starts.data());
        continue;
      }
    }
    turned_[static_cast<size_t>(pair.kind)].push_back(&pair);
  }
  FindNormalsOf(PairKind::kVertexTriangle, starts);
  FindNormalsOf(PairKind::kEdges, starts);
}

template <class V>
void SelfContacts<V>::FindNormalsOf(PairKind kind, std::span<const V> starts) {
  std::span<ContactPair<V>* const> pairs = turned_[static_cast<size_t>(kind)];
  SeldomInterruption interruption(numbers_.interruption);
  while (!pairs.empty()) {
    interruption.Check();
    const auto some = pairs.first(std::min(pairs.size(), kPairsSideBySide));
    const uint32_t are_apart = FindNormals(starts.data(), numbers_.inverse_masses, kind, some);
    for (size_t k = 0; k < some.size(); ++k) {
      some[k]->found_in = substep_;
      impulses_.BeginPair(*some[k], (are_apart >> k & 1) != 0, starts.data());
    }
    pairs = pairs.subspan(some.size());
  }
}

template <class V>
bool SelfContacts<V>::Solve(const V* starts, const V* base, V* u, Real interval,
                            Real least_change) {
  bool has_changed = false;
  hardest_hit_ = 0;
  SeldomInterruption interruption(numbers_.interruption);
  for (const uint32_t k : active_) {
    interruption.Check();
    ContactPair<V>& pair = lists_.pairs()[k];
    if (pair.is_left_alone || pair.inverse_mass == 0) continue;
    const Real squared_change = impulses_.Push(pair, {starts, base, u, interval});
    hardest_hit_ = std::max(hardest_hit_, squared_change);
    has_changed |= squared_change > least_change * least_change;
  }
  hardest_hit_ = interval * std::sqrt(hardest_hit_);
  return has_changed;
}

template <class V>
bool SelfContacts<V>::Guard(const typename PlanarGuard<V>::Motion& motion) {
  bool is_apart = true;
  for (int round = 0;; ++round) {
    const Real drift =
        DriftOf<V>(motion.ends, found_positions_, found_velocities_, since_search_ + substep_s_);
    if (!std::isfinite(drift)) return false;  // the cloth will be faulted
    const bool has_drifted = drift > drift_;
    if (has_drifted) {
      has_found_nothing_ = false;
      if (round > kMostSearches) return GuardFar(motion);
      drift_scale_ = std::min(drift_scale_ * static_cast<Real>(kDriftGrowth),
                              static_cast<Real>(kMaxDriftScale));
      // From the start of the substep, with the velocities that lead to its end.
      ways_.resize(motion.ends.size());
      for (size_t i = 0; i < ways_.size(); ++i) {
        ways_[i] = (motion.ends[i] - motion.starts[i]) / substep_s_;
      }
      // Where particles flutter, only this substep can be told.
      if (round == 0) {
        Search(motion.starts, Smoothed(ways_), numbers_.substeps);
      } else {
        Search(motion.starts, ways_, 1);
      }
      --substeps_left_;
    }
    if (!has_all_pairs_) return GuardFar(motion);
    if (lists_.empty() && !has_drifted) break;
    lists_.MeasureWays([&](uint32_t i) { return V(motion.ends[i] - motion.starts[i]); });
    const bool has_more =
        Wake(motion.starts, {.guards = true, .substeps = numbers_.substeps - substep_ + 1});
    if (!has_all_pairs_) return GuardFar(motion);
    if (round > 0 && !has_drifted && !has_more) break;
    if (round > kMostSearches) return GuardFar(motion);
    active_ways_.clear();
    for (const uint32_t list : active_lists_) {
      active_ways_.push_back(list == ContactLists<V>::kGone ? std::numeric_limits<Real>::max()
                                                            : lists_.way(list));
    }
    is_apart = guard_.Run(lists_.pairs(), active_, active_ways_, motion, numbers_.pulls,
                          numbers_.interruption);
    if (!guard_.has_changed() && !has_drifted) break;
  }
  given_up_ = 0;
  lists_.Advance();
  impulses_.Stop(lists_.pairs(), active_, motion);
  return is_apart;
}

// All particles move alike, or not at all beside pins: nothing passes through anything.
template <class V>
bool SelfContacts<V>::GuardFar(const typename PlanarGuard<V>::Motion& motion) {
  has_given_up_ = true;
  V way{}, velocity{};
  Real mass = 0;
  Real pins = 0;
  for (size_t i = 0; i < found_positions_.size(); ++i) {
    const Real w = numbers_.inverse_masses[i];
    if (w == 0) {
      pins += 1;
      continue;
    }
    way += (motion.ends[i] - motion.starts[i]) / w;
    velocity += motion.velocities[i] / w;
    mass += 1 / w;
  }
  if (mass == 0) return true;
  const bool has_pins = pins > 0;
  const V stopped = velocity / pins;
  way = has_pins ? V{} : V(way / mass);
  velocity = has_pins ? V{} : V(velocity / mass);
  for (size_t i = 0; i < found_positions_.size(); ++i) {
    if (numbers_.inverse_masses[i] == 0) {
      if (!numbers_.pulls.now.empty()) numbers_.pulls.now[i] += stopped;
      continue;
    }
    motion.ends[i] = motion.starts[i] + way;
    motion.velocities[i] = velocity;
  }
  if (!has_all_pairs_) given_up_ = std::min(given_up_ + 1, kMostGivenUp);
  substeps_left_ = 0;
  lists_.Clear();
  active_.clear();
  active_lists_.clear();
  return !has_pins;
}

template class SelfContacts<Vector3f>;
template class SelfContacts<Vector3d>;

}  // namespace drape::self_contact
