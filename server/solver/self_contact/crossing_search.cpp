#include "server/solver/self_contact/crossing_search.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "server/solver/self_contact/exact_orientation.h"
#include "server/solver/self_contact/pair_search.h"

namespace drape::self_contact {
namespace {

// One search. `Found` is called with each crossing, in the order of the tree.
template <class Found>
class CrossingSearch {
 public:
  CrossingSearch(const ContactSurface& surface, std::span<const Vector3d> positions_m,
                 SearchBudget& budget, const Found& found)
      : surface_(surface), positions_(positions_m), budget_(budget), found_(found) {
    patches_.reserve(surface.patches().size());
    edges_.reserve(surface.edges().size());
    triangles_.reserve(surface.triangles().size());
    for (const ContactPatch& patch : surface.patches()) {
      patches_.push_back(BoxOf(surface.corners_of(patch)));
    }
    for (const auto& edge : surface.edges()) edges_.push_back(BoxOf(edge));
    for (const auto& triangle : surface.triangles()) triangles_.push_back(BoxOf(triangle));
    nodes_.resize(surface.nodes().size());
    for (size_t k = nodes_.size(); k-- > 0;) {
      const ContactNode& node = surface.nodes()[k];
      if (node.first_child == 0) {
        nodes_[k] = patches_[node.patch];
      } else {
        nodes_[k] = nodes_[node.first_child];
        nodes_[k].Add(nodes_[node.first_child + 1]);
      }
    }
  }

  void Run() {
    if (!nodes_.empty()) SearchBelow(0, 0);
  }

 private:
  Box<Vector3d> BoxOf(std::span<const uint32_t> particles) {
    budget_.Take(particles.size());
    Box<Vector3d> box;
    for (const uint32_t i : particles) box.Add(positions_[i]);
    return box;
  }

  // The tree is as deep as the logarithm of the number of patches.
  void SearchBelow(uint32_t a, uint32_t b) {
    if (budget_.is_spent()) return;
    budget_.Take(kNodePairLooks);
    const ContactNode& first = surface_.nodes()[a];
    const ContactNode& second = surface_.nodes()[b];
    if (!surface_.MayTouchBelow(a, b) || !AreNear(nodes_[a], nodes_[b], Vector3d{})) return;
    if (first.first_child == 0 && second.first_child == 0) {
      SearchPatches(first.patch, second.patch);
      if (a != b) SearchPatches(second.patch, first.patch);
    } else if (a == b) {
      SearchBelow(first.first_child, first.first_child);
      SearchBelow(first.first_child + 1, first.first_child + 1);
      SearchBelow(first.first_child, first.first_child + 1);
    } else if (first.first_child != 0 && (second.first_child == 0 || a < b)) {
      SearchBelow(first.first_child, b);
      SearchBelow(first.first_child + 1, b);
    } else {
      SearchBelow(a, second.first_child);
      SearchBelow(a, second.first_child + 1);
    }
  }

  // Edges of one patch through triangles of another one.
  void SearchPatches(uint32_t edges_of, uint32_t triangles_of) {
    const Box<Vector3d>& near = patches_[triangles_of];
    const std::span<const uint32_t> edges = surface_.edges_of(surface_.patches()[edges_of]);
    const std::span<const uint32_t> triangles =
        surface_.triangles_of(surface_.patches()[triangles_of]);
    budget_.Take(edges.size());
    for (const uint32_t e : edges) {
      if (!AreNear(edges_[e], near, Vector3d{})) continue;
      budget_.Take(triangles.size());
      for (const uint32_t t : triangles) {
        if (AreNear(edges_[e], triangles_[t], Vector3d{})) Look({e, t});
      }
    }
  }

  void Look(const Crossing& crossing) {
    const std::array<uint32_t, 2>& edge = surface_.edges()[crossing.edge];
    const std::array<uint32_t, 3>& triangle = surface_.triangles()[crossing.triangle];
    const auto has = [&](uint32_t i) {
      return std::find(triangle.begin(), triangle.end(), i) != triangle.end();
    };
    if (has(edge[0]) || has(edge[1])) return;
    uint32_t exact = 0;
    const bool crosses =
        Crosses(At(edge[0]), At(edge[1]), At(triangle[0]), At(triangle[1]), At(triangle[2]), exact);
    budget_.Take(kCrossLooks + kExactLooks * exact);
    if (crosses) found_(crossing);
  }

  Eigen::Vector3d At(uint32_t i) const { return FromVector(positions_[i]); }

  const ContactSurface& surface_;
  const std::span<const Vector3d> positions_;
  SearchBudget& budget_;
  const Found& found_;
  std::vector<Box<Vector3d>> patches_, edges_, triangles_, nodes_;
};

// Calls found(crossing) for all of them, or for some, if the budget is spent then.
template <class Found>
void SearchCrossings(const ContactSurface& surface, std::span<const Vector3d> positions_m,
                     SearchBudget& budget, const Found& found) {
  CrossingSearch<Found>(surface, positions_m, budget, found).Run();
}

}  // namespace

std::vector<Crossing> FindCrossings(const ContactSurface& surface,
                                    std::span<const Vector3d> positions_m) {
  SearchBudget all(std::numeric_limits<size_t>::max());
  std::vector<Crossing> crossings;
  SearchCrossings(surface, positions_m, all,
                  [&](const Crossing& crossing) { crossings.push_back(crossing); });
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
    return std::pair(a.edge, a.triangle) < std::pair(b.edge, b.triangle);
  });
  return crossings;
}

std::vector<bool> FlagCrossings(const ContactSurface& surface,
                                std::span<const Vector3d> positions_m, SearchBudget budget) {
  std::vector<bool> flags;
  SearchCrossings(surface, positions_m, budget, [&](const Crossing& crossing) {
    flags.resize(surface.particle_count());
    for (const uint32_t i : surface.edges()[crossing.edge]) flags[i] = true;
    for (const uint32_t i : surface.triangles()[crossing.triangle]) flags[i] = true;
  });
  if (budget.is_spent()) flags.assign(surface.particle_count(), true);
  return flags;
}

void Tell(const SelfContactMeasures& its, Measurements& measured) {
  measured.near_pairs = its.near_pairs;
  measured.smallest_distance_m = its.smallest_distance_m;
  measured.crossings = its.crossings;
}

std::vector<SelfContactMeasures> MeasureSelfContacts(const ContactSurface& surface,
                                                     const Thicknesses<double>& thicknesses,
                                                     std::span<const Vector3d> positions_m,
                                                     Interruption* interruption) {
  std::vector<SelfContactMeasures> measures(surface.member_count());
  // What two cloths have counts for both.
  const auto count = [&](uint32_t member, uint32_t other, const auto& add) {
    add(measures[member]);
    if (other != member) add(measures[other]);
  };
  SearchBudget crossing_budget = ReportBudget(surface, interruption);
  SearchCrossings(surface, positions_m, crossing_budget, [&](const Crossing& crossing) {
    count(surface.member_of_particle(surface.edges()[crossing.edge][0]),
          surface.member_of_particle(surface.triangles()[crossing.triangle][0]),
          [](SelfContactMeasures& its) { ++its.crossings; });
  });
  // A search finds pairs up to its thickness, or for edges kEdgeShare of it.
  constexpr double kSearchRatio = kNearPairRatio / kEdgeShare;
  std::vector<double> searched;
  for (const double thickness_m : thicknesses.of_members) {
    searched.push_back(kSearchRatio * thickness_m);
  }
  const Thicknesses<double> search{kSearchRatio * thicknesses.most, searched};
  Ask(interruption);
  const std::vector<Vector3d> at_rest(positions_m.size());
  PatchSearch<Vector3d> patch_search;
  std::vector<PatchPair> patches;
  SearchBudget budget = ReportBudget(surface, interruption);
  patch_search.Find(surface, {positions_m, at_rest}, search.most, budget, patches);
  PairSearch<Vector3d> pair_search;
  std::vector<CandidatePair<Vector3d>> pairs;
  pair_search.Begin(surface, positions_m, search, budget);
  for (const PatchPair& two : patches) {
    if (budget.is_spent()) break;
    const double near_m = kNearPairRatio * thicknesses.Of(surface, two.first, two.second);
    pairs.clear();
    pair_search.Find(two, 0, pairs);
    for (const CandidatePair<Vector3d>& pair : pairs) {
      if (pair.distance > near_m) continue;
      if (surface.RestDistance_m(pair.kind, pair.particles) <= near_m) continue;
      count(surface.member_of_patch(two.first), surface.member_of_patch(two.second),
            [&](SelfContactMeasures& its) {
              ++its.near_pairs;
              its.smallest_distance_m = std::min(its.smallest_distance_m, pair.distance);
            });
    }
  }
  return measures;
}

}  // namespace drape::self_contact
