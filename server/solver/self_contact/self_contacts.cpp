#include "server/solver/self_contact/self_contacts.h"

#include <algorithm>
#include <cmath>

#include "server/solver/self_contact/covered_pairs.h"
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
// More pairs than this per particle are not looked at, but all particles move alike [-].
constexpr size_t kMostPairsPerParticle = 200;
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
constexpr int kLandingRounds = DRAPE_CONTACT_LANDING_ROUNDS;

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
  is_crossing_.clear();
  active_.clear();
  active_lists_.clear();
  has_friction_ = std::ranges::any_of(numbers.frictions,
                                      [](const auto& friction) { return friction.statics > 0; });
  lists_.Begin(surface, numbers.thicknesses, numbers.edge_length, is_crossing_,
               kMostPairsPerParticle * surface.particle_count());
  normal_substeps_ = 1 + static_cast<uint32_t>(static_cast<Real>(kNormalAge_s) / substep_s_);
  if (!may_cross) return false;
  std::vector<Vector3d> exact;
  for (const V& p : positions)
    exact.push_back(Vector3d{double{p[0]}, double{p[1]}, double{p[2]}, 0});
  const std::vector<Crossing> crossings = FindCrossings(surface, exact);
  if (crossings.empty()) return false;
  is_crossing_.assign(positions.size(), false);
  for (const Crossing& crossing : crossings) {
    for (const uint32_t i : surface.edges()[crossing.edge]) is_crossing_[i] = true;
    for (const uint32_t i : surface.triangles()[crossing.triangle]) is_crossing_[i] = true;
  }
  return true;
}

template <class V>
std::optional<typename SelfContacts<V>::Expectation> SelfContacts<V>::ExpectNothing(
    const ContactSurface& surface, const StepNumbers<V>& numbers, std::span<const V> positions,
    std::span<const V> velocities) {
  Begin(surface, numbers, false, positions);
  substep_ = 1;
  Search(positions, Smoothed(velocities), numbers.substeps);
  if (!has_found_nothing_) return std::nullopt;
  return Expectation{found_velocities_, drift_, substep_s_};
}

template <class V>
void SelfContacts<V>::Find(std::span<const V> positions, std::span<const V> velocities) {
  ++substep_;
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
  if (has_friction_ && !active_.empty()) {
    start_velocities_.assign(
        velocities.begin(),
        velocities.begin() + static_cast<std::ptrdiff_t>(surface_->particle_count()));
  }
}

template <class V>
void SelfContacts<V>::FindSpeed(ContactPair<V>& pair) const {
  const V relative = Weighted(pair, start_velocities_.data());
  pair.lands = IsLanding(pair, relative);
  const V sliding = relative - Dot(relative, pair.normal) * pair.normal;
  pair.sliding_speed = pair.lands ? Real{0} : Length(sliding);
}

template <class V>
bool SelfContacts<V>::IsLanding(const ContactPair<V>& pair, const V& relative_velocity) const {
  const Real approach = -Dot(relative_velocity, pair.normal);
  return approach > numbers_.slowest_landing &&
         approach > numbers_.slowest_landing + numbers_.grazing_sine * Length(relative_velocity);
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
  // Where nothing touches in the whole step there is nothing else to do in it.
  const bool is_whole = rest == numbers_.substeps;
  if (!is_whole || wanted * static_cast<Real>(kWholeStep) < static_cast<Real>(rest) ||
      !FindPatches(rest)) {
    if (!is_whole || planned < rest) FindPatches(planned);
  }
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
                   numbers_.thicknesses.most, patch_pairs_);
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
  pair_search_.Begin(*surface_, found_positions_, numbers_.thicknesses);
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
    pair.push = 0;
    pair.tangent = V{};
    pair.has_hit = false;
    pair.lands = false;
    pair.sliding_speed = 0;
    if (pair.is_left_alone) continue;
    if (pair.found_in > 0 && substep_ < pair.found_in + normal_substeps_) {
      pair.gap = GapAlong(pair.kind, CornersOf(pair, starts.data()), pair.normal);
      if (pair.gap > pair.touch / 2) {
        EndLook(pair, true, starts);
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
  while (!pairs.empty()) {
    const auto some = pairs.first(std::min(pairs.size(), kPairsSideBySide));
    const uint32_t are_apart = FindNormals(starts.data(), numbers_.inverse_masses, kind, some);
    for (size_t k = 0; k < some.size(); ++k) {
      some[k]->found_in = substep_;
      EndLook(*some[k], (are_apart >> k & 1) != 0, starts);
    }
    pairs = pairs.subspan(some.size());
  }
}

template <class V>
void SelfContacts<V>::EndLook(ContactPair<V>& pair, bool is_apart,
                              std::span<const V> starts) const {
  pair.is_left_alone = !is_apart;
  pair.floor = std::min(pair.touch, pair.gap + numbers_.depenetration_speed * substep_s_);
  const V first = starts[pair.particles[0]];
  const Real size = std::abs(first[0]) + std::abs(first[1]) + std::abs(first[2]);
  const Real rounding =
      numbers_.touch_round_offs * std::numeric_limits<Real>::epsilon() * (size + pair.touch);
  // The gap is at most the difference of the nearest points.
  const Real above = pair.gap > pair.touch + rounding
                         ? pair.gap - pair.touch
                         : Dot(pair.normal, Weighted(pair, starts.data())) - pair.touch;
  pair.is_resting = std::abs(above) < rounding;
  // Of what has left the bound of rounding only the rest of the way counts: all of it at once would
  // be a kick.
  if (!pair.is_resting) pair.floor += above > 0 ? rounding : -rounding;
}

template <class V>
FrictionNumbers<ScalarOf<V>> SelfContacts<V>::FrictionOf(const ContactPair<V>& pair) const {
  const uint32_t member = surface_->member_of_particle(pair.particles[0]);
  const uint32_t other = surface_->member_of_particle(pair.particles[3]);
  const FrictionNumbers<Real>& a = numbers_.frictions[member];
  if (member == other) return a;
  const FrictionNumbers<Real>& b = numbers_.frictions[other];
  return {std::sqrt(a.statics * b.statics), std::sqrt(a.dynamics * b.dynamics)};
}

// How far the nearest points will be apart, beyond where they touch.
template <class V>
static ScalarOf<V> ErrorOf(const ContactPair<V>& pair, const V* starts, const V* base, const V* u,
                           ScalarOf<V> interval) {
  const V move = interval * Weighted(pair, u);
  // Of what rests the way counts, with all its digits: the height is rounded to some per cent of
  // the way that gravity gives in a short substep.
  return pair.is_resting ? Dot(pair.normal, V(WeightedChange(pair, starts, base) + move))
                         : Dot(pair.normal, V(Weighted(pair, base) + move)) - pair.floor;
}

// A normal that leans over a border is true only where it was found. Before its first impulse it is
// found anew, and then the distance of what is nearest at the end counts.
template <class V>
ScalarOf<V> SelfContacts<V>::ErrorAtBorder(ContactPair<V>& pair, const V* starts, const V* base,
                                           const V* u, Real interval) const {
  constexpr Real kNoPush = std::numeric_limits<Real>::max();
  if (pair.push == 0 && pair.found_in != substep_) {
    const bool is_apart = FindNormal(starts, numbers_.inverse_masses, pair);
    pair.found_in = substep_;
    EndLook(pair, is_apart, {starts, surface_->particle_count()});
    if (!is_apart || pair.inverse_mass == 0) return kNoPush;
  }
  if (pair.push == 0 && IsCovered(*surface_, {starts, surface_->particle_count()}, pair)) {
    return kNoPush;
  }
  const Real error = ErrorOf(pair, starts, base, u, interval);
  if (error >= 0 || pair.is_resting || !IsAtBorder(pair)) return error;
  std::array<V, 4> ends;
  for (int k = 0; k < 4; ++k) {
    ends[k] = base[pair.particles[k]] + interval * u[pair.particles[k]];
  }
  const V difference = Closest(pair.kind, ends).difference;
  // What has come to the other side has no true distance.
  if (Dot(pair.normal, difference) <= 0) return error;
  return std::max(error, Length(difference) - pair.floor);
}

template <class V>
bool SelfContacts<V>::SolvePush(ContactPair<V>& pair, const V* starts, const V* base, V* u,
                                Real interval, Real least_change) {
  Real error = ErrorOf(pair, starts, base, u, interval);
  if (error >= 0 && pair.push == 0) return false;
  if (IsAtBorder(pair)) {
    error = ErrorAtBorder(pair, starts, base, u, interval);
    if (error >= 0 && pair.push == 0) return false;
  }
  const Real push = std::max(pair.push - error / interval, Real{0});
  const Real change = push - pair.push;
  pair.push = push;
  V velocity_change = change * pair.normal;
  if (has_friction_) {
    if (!pair.has_hit) FindSpeed(pair);
    const V relative = Weighted(pair, static_cast<const V*>(u)) + velocity_change;
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
  Apply(pair, velocity_change, numbers_.inverse_masses, u);
  Pull(pair, velocity_change, numbers_.inverse_masses, numbers_.pulls.now);
  pair.has_hit |= push > 0;
  const Real squared_change = SquaredLength(velocity_change);
  hardest_hit_ = std::max(hardest_hit_, squared_change);
  return squared_change > least_change * least_change;
}

template <class V>
bool SelfContacts<V>::Solve(const V* starts, const V* base, V* u, Real interval,
                            Real least_change) {
  bool has_changed = false;
  hardest_hit_ = 0;
  for (const uint32_t k : active_) {
    ContactPair<V>& pair = lists_.pairs()[k];
    if (pair.is_left_alone || pair.inverse_mass == 0) continue;
    has_changed |= SolvePush(pair, starts, base, u, interval, least_change);
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
    is_apart = guard_.Run(lists_.pairs(), active_, active_ways_, motion, numbers_.pulls);
    if (!guard_.has_changed() && !has_drifted) break;
  }
  lists_.Advance();
  StopTouching(motion, !motion.previous_velocities.empty());
  return is_apart;
}

// All particles move alike, or not at all beside pins: nothing passes through anything.
template <class V>
bool SelfContacts<V>::GuardFar(const typename PlanarGuard<V>::Motion& motion) {
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
  substeps_left_ = 0;
  lists_.Clear();
  active_.clear();
  active_lists_.clear();
  return !has_pins;
}

// What touches has no velocity along the normal, and friction has its part of the impulse.
template <class V>
void SelfContacts<V>::StopTouching(const typename PlanarGuard<V>::Motion& motion,
                                   bool has_history) {
  const std::span<ContactPair<V>> pairs = lists_.pairs();
  const auto has_stopped = [&](uint32_t k) {
    return pairs[k].has_hit && pairs[k].inverse_mass != 0 && !pairs[k].is_left_alone;
  };
  landed_.clear();
  for (const uint32_t k : active_) {
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
  if (!has_history) return;
  for (const uint32_t k : active_) {
    if (has_stopped(k)) ForgetLanding(pairs[k], motion);
  }
}

// Of what lands only the last round can tell whether it slides on.
template <class V>
void SelfContacts<V>::StopPair(ContactPair<V>& pair, V* velocities, bool is_last) {
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
void SelfContacts<V>::ForgetLanding(const ContactPair<V>& pair,
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

template class SelfContacts<Vector3f>;
template class SelfContacts<Vector3d>;

}  // namespace drape::self_contact
