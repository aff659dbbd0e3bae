#include "server/scene/tethers.h"

#include <algorithm>
#include <numeric>
#include <queue>
#include <tuple>

namespace drape {
namespace {

// A bound this close to the one that a nearer pin implies adds nothing but rounding.
constexpr double kImpliedMargin = 1e-9;

struct Neighbour {
  uint32_t particle = 0;
  double length_m = 0;
};

double LengthOf(const DistanceConstraint& constraint) {
  return constraint.rest_length_m;
}
double LengthOf(const PointJoint&) {
  return 0;
}

// Whether the length between two particles is a bound on their distance.
bool IsBound(const DistanceConstraint& constraint) {
  return constraint.compliance_m_per_n == 0 && constraint.kind != ConstraintKind::kAtLeast;
}
bool IsBound(const PointJoint& joint) {
  return joint.compliance_m_per_n == 0;
}

// The constraints that bound distances, by particle.
class Adjacency {
 public:
  Adjacency(std::span<const DistanceConstraint> constraints, std::span<const PointJoint> joints,
            size_t particle_count)
      : offsets_(particle_count + 1, 0) {
    Count(constraints);
    Count(joints);
    std::partial_sum(offsets_.begin(), offsets_.end(), offsets_.begin());
    neighbours_.resize(offsets_.back());
    std::vector<uint32_t> next(offsets_.begin(), offsets_.end() - 1);
    Connect(constraints, next);
    Connect(joints, next);
  }

  std::span<const Neighbour> Of(uint32_t particle) const {
    return std::span(neighbours_)
        .subspan(offsets_[particle], offsets_[particle + 1] - offsets_[particle]);
  }

 private:
  template <class Pair>
  void Count(std::span<const Pair> pairs) {
    for (const Pair& pair : pairs) {
      if (!IsBound(pair)) continue;
      ++offsets_[pair.i + 1];
      ++offsets_[pair.j + 1];
    }
  }

  template <class Pair>
  void Connect(std::span<const Pair> pairs, std::vector<uint32_t>& next) {
    for (const Pair& pair : pairs) {
      if (!IsBound(pair)) continue;
      neighbours_[next[pair.i]++] = {pair.j, LengthOf(pair)};
      neighbours_[next[pair.j]++] = {pair.i, LengthOf(pair)};
    }
  }

  std::vector<uint32_t> offsets_;  // [particle_count + 1]
  std::vector<Neighbour> neighbours_;
};

// Dijkstra's algorithm from all pins at once, with up to kMaxTethersPerParticle final distances per
// particle, each to another pin.
class TetherSearch {
 public:
  TetherSearch(std::span<const Eigen::Vector3d> rest_positions_m,
               std::span<const DistanceConstraint> constraints, std::span<const PointJoint> joints,
               std::span<const uint32_t> pins)
      : rest_positions_m_(rest_positions_m),
        adjacency_(constraints, joints, rest_positions_m.size()),
        is_pin_(rest_positions_m.size(), false),
        found_(rest_positions_m.size()) {
    for (const uint32_t pin : pins) is_pin_[pin] = true;
    for (const uint32_t pin : pins) Reach(pin, {pin, 0});
  }

  TetherSet Run() {
    while (!front_.empty()) {
      const auto [length_m, particle, pin] = front_.top();
      front_.pop();
      if (!IsNeeded(particle, {pin, length_m})) continue;
      found_[particle].push_back({pin, length_m});
      Reach(particle, {pin, length_m});
    }
    TetherSet set;
    set.offsets.push_back(0);
    for (std::vector<Tether>& found : found_) {
      std::ranges::sort(found, {}, &Tether::pin);
      set.tethers.insert(set.tethers.end(), found.begin(), found.end());
      set.offsets.push_back(static_cast<uint32_t>(set.tethers.size()));
    }
    return set;
  }

 private:
  // Continues from a particle to its free neighbours.
  void Reach(uint32_t particle, const Tether& tether) {
    for (const Neighbour& neighbour : adjacency_.Of(particle)) {
      const Tether next{tether.pin, tether.length_m + neighbour.length_m};
      // Checked here too, so that the front stays short.
      if (is_pin_[neighbour.particle] || !IsNeeded(neighbour.particle, next)) continue;
      front_.emplace(next.length_m, neighbour.particle, next.pin);
    }
  }

  bool IsNeeded(uint32_t particle, const Tether& tether) const {
    const std::vector<Tether>& nearer = found_[particle];
    if (nearer.size() >= kMaxTethersPerParticle) return false;
    return std::none_of(nearer.begin(), nearer.end(), [&](const Tether& other) {
      if (other.pin == tether.pin) return true;
      const double between = (rest_positions_m_[other.pin] - rest_positions_m_[tether.pin]).norm();
      return tether.length_m >= (other.length_m + between) * (1 - kImpliedMargin);
    });
  }

  // (length, particle, pin): ties are broken by index, so the result depends on the cloth alone.
  using Entry = std::tuple<double, uint32_t, uint32_t>;

  std::span<const Eigen::Vector3d> rest_positions_m_;
  const Adjacency adjacency_;
  std::vector<bool> is_pin_;
  std::vector<std::vector<Tether>> found_;  // [particle_count]
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front_;
};

}  // namespace

TetherSet FindTethers(std::span<const Eigen::Vector3d> rest_positions_m,
                      std::span<const DistanceConstraint> constraints,
                      std::span<const PointJoint> joints, std::span<const uint32_t> pins) {
  if (pins.empty()) {
    return {std::vector<uint32_t>(rest_positions_m.size() + 1, 0), {}};
  }
  return TetherSearch(rest_positions_m, constraints, joints, pins).Run();
}

}  // namespace drape
