#include "server/solver/self_contact/planar_guard.h"

#include <algorithm>
#include <numeric>

namespace drape::self_contact {
namespace {

// Rounds of impulses before particles are stopped [-]. More: time in violent motion; fewer: more
// zones, which strain the cloth.
constexpr int kPushRounds = 8;
// Rounds of zones in which pins may push [-]. Without pins there is no need for a limit.
constexpr int kMaxZoneRounds = 1000;

}  // namespace

template <class V>
typename PlanarGuard<V>::Real PlanarGuard<V>::Core(const ContactPair<V>& pair) const {
  return std::min(static_cast<Real>(kCoreShare) * pair.touch, pair.gap);
}

// Along the normal at the start, or along that at the end.
template <class V>
bool PlanarGuard<V>::IsApart(ContactPair<V>& pair, const Motion& motion) const {
  // Ends are rounded when they are stored: by far less than this.
  const Real core = Core(pair) * Real{0.984375};
  const std::array<V, 4> ends = CornersOf(pair, static_cast<const V*>(motion.ends.data()));
  if (GapAlong(pair.kind, ends, pair.normal) >= core) return true;
  const ClosestPoints<V> closest = Closest(pair.kind, ends);
  const Real distance = Length(closest.difference);
  if (!(distance >= core)) return false;
  const V normal = closest.difference / distance;
  return GapAlong(pair.kind, CornersOf(pair, motion.starts.data()), normal) > 0 &&
         GapAlong(pair.kind, ends, normal) >= core;
}

template <class V>
bool PlanarGuard<V>::Run(std::span<ContactPair<V>> pairs, std::span<const uint32_t> active,
                         std::span<const Real> ways, const Motion& motion,
                         const HeldPulls<V>& pulls, Interruption* interruption) {
  pulls_ = pulls;
  interruption_ = interruption;
  suspects_.clear();
  has_changed_ = false;
  for (size_t place = 0; place < active.size(); ++place) {
    const ContactPair<V>& pair = pairs[active[place]];
    if (pair.is_left_alone || pair.gap - ways[place] > Core(pair)) continue;
    suspects_.push_back(active[place]);
  }
  if (suspects_.empty()) return true;
  has_changed_ = PushApart(pairs, motion);
  if (!has_changed_) return true;
  return StopInZones(pairs, active, motion);
}

// The corner of the first primitive that is lowest along the normal and that of the second one that
// is highest are pushed apart. Whether there was anything to do.
template <class V>
bool PlanarGuard<V>::PushApart(std::span<ContactPair<V>> pairs, const Motion& motion) {
  bool has_found = false;
  SeldomInterruption interruption(interruption_);
  for (int round = 0; round < kPushRounds; ++round) {
    bool has_pushed = false;
    for (const uint32_t k : suspects_) {
      interruption.Check();
      ContactPair<V>& pair = pairs[k];
      if (IsApart(pair, motion)) continue;
      has_found = true;
      const int first_corners = FirstCorners(pair.kind);
      const std::array<V, 4> ends = CornersOf(pair, static_cast<const V*>(motion.ends.data()));
      std::array<Real, 4> heights;
      for (int c = 0; c < 4; ++c) heights[c] = Dot(pair.normal, V(ends[c] - ends[0]));
      int low = 0, high = first_corners;
      for (int c = 0; c < 4; ++c) {
        if (c < first_corners && heights[c] < heights[low]) low = c;
        if (c > first_corners && heights[c] > heights[high]) high = c;
      }
      const uint32_t i = pair.particles[low], j = pair.particles[high];
      const Real w_i = motion.inverse_masses[i], w_j = motion.inverse_masses[j];
      if (w_i + w_j == 0) continue;
      const Real missing = Core(pair) - (heights[low] - heights[high]);
      const V push = (missing / (w_i + w_j)) * pair.normal;
      motion.ends[i] += w_i * push;
      motion.ends[j] -= w_j * push;
      motion.velocities[i] += (w_i / motion.duration) * push;
      motion.velocities[j] -= (w_j / motion.duration) * push;
      if (!pulls_.now.empty()) {
        if (w_i == 0) pulls_.now[i] += push / motion.duration;
        if (w_j == 0) pulls_.now[j] -= push / motion.duration;
      }
      pair.has_hit = has_pushed = true;
    }
    if (!has_pushed) break;
  }
  return has_found;
}

template <class V>
uint32_t PlanarGuard<V>::RootOf(uint32_t particle) {
  while (parents_[particle] != particle) {
    parents_[particle] = parents_[parents_[particle]];
    particle = parents_[particle];
  }
  return particle;
}

// The root of a zone is its smallest particle, whatever the order of the pairs.
template <class V>
void PlanarGuard<V>::Join(const ContactPair<V>& pair) {
  for (const uint32_t i : pair.particles) {
    if (!is_member_[i]) members_.push_back(i);
    is_member_[i] = true;
    const uint32_t root = RootOf(pair.particles[0]), other = RootOf(i);
    parents_[std::max(root, other)] = std::min(root, other);
  }
}

template <class V>
bool PlanarGuard<V>::StopInZones(std::span<ContactPair<V>> pairs, std::span<const uint32_t> active,
                                 const Motion& motion) {
  const size_t particles = motion.ends.size();
  wanted_.assign(motion.ends.begin(), motion.ends.end());
  parents_.resize(particles);
  std::iota(parents_.begin(), parents_.end(), 0u);
  is_member_.assign(particles, false);
  has_planes_.assign(active.size(), false);
  members_.clear();
  stopped_.clear();
  zones_.resize(particles);
  shares_.resize(particles);
  pushes_.resize(particles);
  SeldomInterruption interruption(interruption_);
  // Stopping moves other pairs, also such that were not suspect.
  for (int round = 0; round < kMaxZoneRounds; ++round) {
    const size_t before = stopped_.size();
    for (size_t place = 0; place < active.size(); ++place) {
      interruption.Check();
      ContactPair<V>& pair = pairs[active[place]];
      if (has_planes_[place] || pair.is_left_alone || IsApart(pair, motion)) continue;
      has_planes_[place] = true;
      pair.has_hit = true;
      stopped_.push_back(active[place]);
      Join(pair);
    }
    if (stopped_.size() == before) break;
    MoveZones(pairs, motion);
  }
  EndZones(motion);
  return std::all_of(stopped_.begin(), stopped_.end(), [&](uint32_t k) {
    return GapAlong(pairs[k].kind, CornersOf(pairs[k], static_cast<const V*>(motion.ends.data())),
                    pairs[k].normal) > 0;
  });
}

template <class V>
void PlanarGuard<V>::MoveZones(std::span<ContactPair<V>> pairs, const Motion& motion) {
  std::sort(members_.begin(), members_.end());
  for (const uint32_t i : members_) {
    zones_[i] = Zone();
    shares_[i] = 1;
    pushes_[i] = V{};
  }
  for (const uint32_t i : members_) {
    Zone& zone = zones_[RootOf(i)];
    const V way = wanted_[i] - motion.starts[i];
    const Real w = motion.inverse_masses[i];
    if (w == 0) {
      if (zone.pins++ == 0) zone.way = V{};
      zone.way += way;
    } else if (zone.pins == 0) {
      zone.way += way / w;
    }
    if (w != 0) zone.mass += 1 / w;
  }
  for (const uint32_t i : members_) {
    Zone& zone = zones_[i];
    if (parents_[i] == i) zone.way /= zone.pins > 0 ? static_cast<Real>(zone.pins) : zone.mass;
  }
  for (const uint32_t k : stopped_) LimitWays(pairs[k], motion);
  for (const uint32_t i : members_) {
    Zone& zone = zones_[RootOf(i)];
    if (motion.inverse_masses[i] == 0) continue;
    const V relative = (wanted_[i] - motion.starts[i]) - zone.way;
    motion.ends[i] = (motion.starts[i] + zone.way) + (shares_[i] * relative + pushes_[i]);
    zone.shift += ((1 - shares_[i]) / motion.inverse_masses[i]) * relative;
  }
  for (const uint32_t i : members_) {
    const Zone& zone = zones_[RootOf(i)];
    if (zone.pins > 0 || motion.inverse_masses[i] == 0) continue;
    motion.ends[i] += zone.shift / zone.mass;
  }
}

// The planes lie halfway between the primitives at the start, the core apart, and move with the
// zone; those of pins give way to the pins.
template <class V>
void PlanarGuard<V>::LimitWays(const ContactPair<V>& pair, const Motion& motion) {
  const Zone& zone = zones_[RootOf(pair.particles[0])];
  const int first_corners = FirstCorners(pair.kind);
  const V origin = motion.starts[pair.particles[0]];
  std::array<Real, 4> heights, ways;
  Real low = std::numeric_limits<Real>::max(), high = -low;
  for (int c = 0; c < 4; ++c) {
    const uint32_t i = pair.particles[c];
    heights[c] = Dot(pair.normal, V(motion.starts[i] - origin));
    ways[c] = Dot(pair.normal, V((wanted_[i] - motion.starts[i]) - zone.way));
    if (c < first_corners) {
      low = std::min(low, heights[c]);
    } else {
      high = std::max(high, heights[c]);
    }
  }
  const Real middle = (low + high) / 2;
  Real upper = middle + Core(pair) / 2, lower = middle - Core(pair) / 2;
  for (int c = 0; c < 4; ++c) {
    if (motion.inverse_masses[pair.particles[c]] != 0) continue;
    if (c < first_corners) upper = std::min(upper, heights[c] + ways[c]);
    if (c >= first_corners) lower = std::max(lower, heights[c] + ways[c]);
  }
  if (upper < middle) lower = std::min(lower, upper - Core(pair));
  if (lower > middle) upper = std::max(upper, lower + Core(pair));
  for (int c = 0; c < 4; ++c) {
    const uint32_t i = pair.particles[c];
    if (motion.inverse_masses[i] == 0) continue;
    const bool is_first = c < first_corners;
    const Real room = is_first ? heights[c] - upper : lower - heights[c];
    const Real approach = is_first ? -ways[c] : ways[c];
    if (room < 0) {  // only beside pins
      shares_[i] = 0;
      pushes_[i] += (is_first ? -room : room) * pair.normal;
    } else if (approach > room) {
      shares_[i] = std::min(shares_[i], room / approach);
    }
  }
}

// Relative to the mean of its zone a particle goes on as if it had always flown as it did in this
// substep; the mean keeps its history. So the momentum stays what it was.
template <class V>
void PlanarGuard<V>::EndZones(const Motion& motion) {
  const bool has_history = !motion.previous_velocities.empty();
  for (const uint32_t i : members_) zones_[i] = Zone();
  for (const uint32_t i : members_) {
    Zone& zone = zones_[RootOf(i)];
    const Real w = motion.inverse_masses[i];
    if (w == 0) {
      ++zone.pins;
      continue;
    }
    const Real mass = 1 / w;
    zone.mass += mass;
    zone.way += mass * (motion.ends[i] - motion.starts[i]);
    zone.velocity += mass * motion.velocities[i];
    if (has_history) zone.previous_velocity += mass * motion.previous_velocities[i];
  }
  for (const uint32_t i : members_) {
    const Real w = motion.inverse_masses[i];
    if (w == 0) continue;
    Zone& zone = zones_[RootOf(i)];
    const V way = motion.ends[i] - motion.starts[i];
    const V mean_way = zone.pins > 0 ? V{} : V(zone.way / zone.mass);
    const V relative = (way - mean_way) / motion.duration;
    if (zone.pins > 0) {
      zone.stopped += (motion.velocities[i] - relative) / w;
      if (has_history) zone.stopped_in_memory += (relative - motion.previous_velocities[i]) / w;
    }
    motion.velocities[i] = zone.pins > 0 ? relative : V(zone.velocity / zone.mass + relative);
    if (has_history) {
      motion.previous_velocities[i] =
          zone.pins > 0 ? relative : V(zone.previous_velocity / zone.mass + relative);
    }
  }
  if (!pulls_.now.empty()) PullPins(motion);
}

template <class V>
void PlanarGuard<V>::PullPins(const Motion& motion) {
  for (const uint32_t i : members_) {
    if (motion.inverse_masses[i] != 0) continue;
    const Zone& zone = zones_[RootOf(i)];
    const auto pins = static_cast<Real>(zone.pins);
    pulls_.now[i] += zone.stopped / pins;
    pulls_.in_memory[i] += zone.stopped_in_memory / pins;
  }
}

template class PlanarGuard<Vector3f>;
template class PlanarGuard<Vector3d>;

}  // namespace drape::self_contact
