#include "server/scene/strips.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

namespace drape {

namespace {

using Eigen::Vector3d;

constexpr uint32_t kNone = ~uint32_t{0};
// Cosine between the two edges, both seen from the particle between them: 70 degrees from straight.
constexpr double kMaxJoinedCosine = -0.35;
// A particle with more edges is the hub of a star: no path passes through it.
constexpr uint32_t kMaxJoinedDegree = 32;
// Cosines are compared in these units, so that the last digits of the rest shape decide nothing.
constexpr double kCosineSteps = 1e6;

// The constraints of each particle, ascending: entries offsets[p] .. offsets[p + 1] of list.
struct Incidence {
  std::vector<uint32_t> offsets;
  std::vector<uint32_t> list;
};

Incidence FindIncidence(std::span<const DistanceConstraint> constraints, size_t particle_count) {
  Incidence incidence;
  incidence.offsets.assign(particle_count + 1, 0);
  for (const DistanceConstraint& c : constraints) {
    ++incidence.offsets[c.i + 1];
    ++incidence.offsets[c.j + 1];
  }
  std::partial_sum(incidence.offsets.begin(), incidence.offsets.end(), incidence.offsets.begin());
  incidence.list.resize(2 * constraints.size());
  std::vector<uint32_t> next(incidence.offsets.begin(), incidence.offsets.end() - 1);
  for (uint32_t c = 0; c < constraints.size(); ++c) {
    incidence.list[next[constraints[c].i]++] = c;
    incidence.list[next[constraints[c].j]++] = c;
  }
  return incidence;
}

// Cuts the graph into paths.
class PathCover {
 public:
  PathCover(std::span<const Vector3d> rest_positions_m,
            std::span<const DistanceConstraint> constraints)
      : positions_(rest_positions_m),
        constraints_(constraints),
        incidence_(FindIncidence(constraints, rest_positions_m.size())),
        mates_(2 * constraints.size(), kNone),
        is_taken_(constraints.size(), false),
        last_path_(rest_positions_m.size(), kNone) {}

  struct Path {
    std::vector<uint32_t> links;
    std::vector<uint32_t> particles;  // one more
  };

  std::vector<Path> Find(Interruption* interruption) {
    SeldomInterruption seldom(interruption);
    for (uint32_t p = 0; p < positions_.size(); ++p) {
      seldom.Check();
      JoinEdgesOf(p);
    }
    std::vector<Path> paths;
    // Starts at ends, then takes the rest: rings, from their first edge.
    for (uint32_t c = 0; c < constraints_.size(); ++c) {
      seldom.Check();
      if (is_taken_[c]) continue;
      if (MateAt(c, constraints_[c].i) == kNone) {
        Trace(c, constraints_[c].i, paths);
      } else if (MateAt(c, constraints_[c].j) == kNone) {
        Trace(c, constraints_[c].j, paths);
      }
    }
    for (uint32_t c = 0; c < constraints_.size(); ++c) {
      seldom.Check();
      if (!is_taken_[c]) Trace(c, constraints_[c].i, paths);
    }
    return paths;
  }

 private:
  uint32_t OtherEnd(uint32_t c, uint32_t p) const {
    return constraints_[c].i == p ? constraints_[c].j : constraints_[c].i;
  }
  uint32_t& MateAt(uint32_t c, uint32_t p) {
    return mates_[2 * size_t{c} + (constraints_[c].i == p ? 0 : 1)];
  }

  void Join(uint32_t c, uint32_t d, uint32_t p) {
    MateAt(c, p) = d;
    MateAt(d, p) = c;
  }

  void JoinEdgesOf(uint32_t p) {
    const std::span<const uint32_t> edges(incidence_.list.data() + incidence_.offsets[p],
                                          incidence_.offsets[p + 1] - incidence_.offsets[p]);
    if (edges.size() > kMaxJoinedDegree) return;
    if (edges.size() == 2 && IsInChain(p, edges)) return Join(edges[0], edges[1], p);
    struct Pair {
      long cosine;  // in steps of 1 / kCosineSteps
      uint32_t c, d;
    };
    std::vector<Pair> pairs;
    for (size_t a = 0; a < edges.size(); ++a) {
      const Vector3d to_a = DirectionFrom(p, edges[a]);
      for (size_t b = a + 1; b < edges.size(); ++b) {
        const double cosine = to_a.dot(DirectionFrom(p, edges[b]));
        if (cosine < kMaxJoinedCosine) {
          pairs.push_back({std::lround(cosine * kCosineSteps), edges[a], edges[b]});
        }
      }
    }
    std::stable_sort(pairs.begin(), pairs.end(),
                     [](const Pair& x, const Pair& y) { return x.cosine < y.cosine; });
    for (const Pair& pair : pairs) {
      if (MateAt(pair.c, p) == kNone && MateAt(pair.d, p) == kNone) Join(pair.c, pair.d, p);
    }
  }

  uint32_t DegreeOf(uint32_t p) const { return incidence_.offsets[p + 1] - incidence_.offsets[p]; }

  // Whether `edges`, those of p, are in a chain. A corner of a cloth has two edges as well, but its
  // neighbours have more.
  bool IsInChain(uint32_t p, std::span<const uint32_t> edges) const {
    return std::ranges::all_of(edges, [&](uint32_t c) { return DegreeOf(OtherEnd(c, p)) <= 2; });
  }

  Vector3d DirectionFrom(uint32_t p, uint32_t c) const {
    return (positions_[OtherEnd(c, p)] - positions_[p]).stableNormalized();
  }

  // Follows the mates from edge c, entered at particle p, until there is none, the path meets
  // itself or is long enough.
  void Trace(uint32_t c, uint32_t p, std::vector<Path>& paths) {
    const uint32_t path_index = static_cast<uint32_t>(paths.size());
    Path path;
    path.particles.push_back(p);
    last_path_[p] = path_index;
    while (c != kNone && !is_taken_[c] && path.links.size() < kMaxStripLinks) {
      p = OtherEnd(c, p);
      if (last_path_[p] == path_index) break;
      last_path_[p] = path_index;
      is_taken_[c] = true;
      path.links.push_back(c);
      path.particles.push_back(p);
      c = MateAt(c, p);
    }
    paths.push_back(std::move(path));
  }

  std::span<const Vector3d> positions_;
  std::span<const DistanceConstraint> constraints_;
  const Incidence incidence_;
  std::vector<uint32_t> mates_;  // [constraint][end i, end j]
  std::vector<bool> is_taken_;
  std::vector<uint32_t> last_path_;  // [particle] the last path through it
};

using Path = PathCover::Path;

// First fit; [path_count]. A particle's taken phases are a list: few paths meet in one.
std::vector<uint32_t> ChoosePhases(const std::vector<Path>& paths, const std::vector<bool>& is_pin,
                                   Interruption* interruption) {
  SeldomInterruption seldom(interruption);
  std::vector<std::vector<uint32_t>> taken(is_pin.size());
  std::vector<uint32_t> phases;
  std::vector<uint32_t> blocker;  // [phase] the last path that cannot be in it
  for (uint32_t path = 0; path < paths.size(); ++path) {
    seldom.Check();
    for (const uint32_t p : paths[path].particles) {
      for (const uint32_t phase : taken[p]) blocker[phase] = path;
    }
    const auto free =
        std::find_if(blocker.begin(), blocker.end(), [&](uint32_t b) { return b != path; });
    const uint32_t phase = static_cast<uint32_t>(free - blocker.begin());
    if (free == blocker.end()) blocker.push_back(kNone);
    phases.push_back(phase);
    for (const uint32_t p : paths[path].particles) {
      if (!is_pin[p]) taken[p].push_back(phase);
    }
  }
  return phases;
}

// Whether a particle whips: between two of a strip that are much heavier, and held by nothing else,
// or in a cloth without cells.
bool HasWhippingBead(const StripSet& strips, std::span<const DistanceConstraint> constraints,
                     std::span<const double> w) {
  std::vector<uint32_t> degrees(w.size(), 0);
  for (const DistanceConstraint& c : constraints) {
    ++degrees[c.i];
    ++degrees[c.j];
  }
  const bool has_cells = constraints.size() >= w.size();
  for (uint32_t s = 0; s < strips.strip_count(); ++s) {
    for (uint32_t k = strips.strip_offsets[s] + 1; k < strips.strip_offsets[s + 1]; ++k) {
      const uint32_t* const bead = &strips.particles[k + s];
      const double w_before = w[bead[-1]], w_bead = w[bead[0]], w_behind = w[bead[1]];
      if (has_cells && degrees[bead[0]] > 2) continue;
      if (w_before + w_behind == 0) continue;  // between pins it cannot whip
      if (w_bead > kUnequalMassRatio * std::max(w_before, w_behind)) return true;
    }
  }
  return false;
}

void AddPhaseAgain(uint32_t phase, StripSet& strips) {
  for (uint32_t s = strips.phase_offsets[phase]; s < strips.phase_offsets[phase + 1]; ++s) {
    const uint32_t begin = strips.strip_offsets[s], end = strips.strip_offsets[s + 1];
    for (uint32_t k = begin; k < end; ++k) strips.constraints.push_back(strips.constraints[k]);
    for (uint32_t k = begin; k <= end; ++k) strips.particles.push_back(strips.particles[k + s]);
    strips.strip_offsets.push_back(static_cast<uint32_t>(strips.constraints.size()));
  }
  strips.phase_offsets.push_back(strips.strip_count());
}

}  // namespace

StripSet FindStrips(std::span<const Vector3d> rest_positions_m,
                    std::span<const DistanceConstraint> constraints,
                    const std::vector<bool>& is_pin, Interruption* interruption) {
  std::vector<Path> paths = PathCover(rest_positions_m, constraints).Find(interruption);
  Ask(interruption);
  std::stable_sort(paths.begin(), paths.end(),
                   [](const Path& a, const Path& b) { return a.links.size() > b.links.size(); });
  const std::vector<uint32_t> phases = ChoosePhases(paths, is_pin, interruption);
  Ask(interruption);
  std::vector<uint32_t> order(paths.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return phases[a] < phases[b]; });

  StripSet strips;
  for (size_t k = 0; k < order.size(); ++k) {
    const auto& [links, particles] = paths[order[k]];
    strips.constraints.insert(strips.constraints.end(), links.begin(), links.end());
    strips.particles.insert(strips.particles.end(), particles.begin(), particles.end());
    strips.strip_offsets.push_back(static_cast<uint32_t>(strips.constraints.size()));
    const bool ends_phase = k + 1 == order.size() || phases[order[k + 1]] != phases[order[k]];
    if (ends_phase) strips.phase_offsets.push_back(strips.strip_count());
  }
  strips.phase_count_there = strips.phase_count();
  return strips;
}

uint32_t WaysBack(const StripSet& strips, std::span<const DistanceConstraint> constraints,
                  std::span<const double> inverse_masses_per_kg) {
  const std::span<const double> w = inverse_masses_per_kg;
  const auto is_rigid = [](const DistanceConstraint& c) { return c.compliance_m_per_n == 0; };
  if (std::ranges::none_of(constraints, is_rigid)) return 0;
  if (HasWhippingBead(strips, constraints, w)) return 2;
  const auto is_unequal = [&](const DistanceConstraint& c) {
    const auto [heavy, light] = std::minmax(w[c.i], w[c.j]);
    return heavy > 0 && light > kUnequalMassRatio * heavy;
  };
  const bool has_unequal_masses = std::ranges::any_of(constraints, is_unequal);
  const bool needs_way =
      strips.phase_count() > 2 || (strips.phase_count() == 2 && has_unequal_masses);
  return needs_way ? 1 : 0;
}

void AddWaysBack(uint32_t count, StripSet& strips) {
  if (strips.phase_count() == 0) return;
  const uint32_t last = strips.phase_count_there - 1;
  for (uint32_t way = 0; way < count; ++way) {
    for (uint32_t phase = 1; way > 0 && phase <= last; ++phase) AddPhaseAgain(phase, strips);
    for (uint32_t phase = std::max(last, 1u); phase-- > 0;) AddPhaseAgain(phase, strips);
  }
}

bool HangsByStrips(const StripSet& strips, const std::vector<bool>& is_pin) {
  std::vector<bool> hangs = is_pin;
  for (uint32_t s = 0; s < strips.strip_count(); ++s) {
    const auto begin = strips.particles.begin() + strips.strip_offsets[s] + s;
    const auto end = strips.particles.begin() + strips.strip_offsets[s + 1] + s + 1;
    const auto pins = std::count_if(begin, end, [&](uint32_t i) { return is_pin[i]; });
    if (pins > 1) return false;
    if (pins == 0) continue;
    std::for_each(begin, end, [&](uint32_t i) { hangs[i] = true; });
  }
  return std::all_of(hangs.begin(), hangs.end(), [](bool is_hanging) { return is_hanging; });
}

std::vector<bool> FindSpans(const StripSet& strips, const std::vector<bool>& is_pin) {
  std::vector<bool> is_span(strips.strip_count(), false);
  bool has_spans = false;
  for (uint32_t s = 0; s < strips.strip_count(); ++s) {
    const auto begin = strips.particles.begin() + strips.strip_offsets[s] + s;
    const auto end = strips.particles.begin() + strips.strip_offsets[s + 1] + s + 1;
    is_span[s] = std::count_if(begin, end, [&](uint32_t i) { return is_pin[i]; }) > 1;
    has_spans |= is_span[s];
  }
  if (!has_spans) is_span.clear();
  return is_span;
}

}  // namespace drape
