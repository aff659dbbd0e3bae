#include "server/solver/self_contact/pair_search.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace drape::self_contact {

double TouchDistance_m(const ContactSurface& surface, PairKind kind,
                       const std::array<uint32_t, 4>& particles, double thickness_m,
                       bool may_be_near_at_rest) {
  const double touch_m = kind == PairKind::kEdges ? kEdgeShare * thickness_m : thickness_m;
  if (!may_be_near_at_rest) return touch_m;
  const double rest_m = surface.RestDistance_m(kind, particles);
  return rest_m < thickness_m ? std::min(touch_m, kRestShare * rest_m) : touch_m;
}

template <class V>
void PairSearch<V>::Begin(const ContactSurface& surface, std::span<const V> positions,
                          const Thicknesses<Real>& thicknesses, SearchBudget& budget) {
  surface_ = &surface;
  budget_ = &budget;
  positions_ = positions;
  thicknesses_ = thicknesses;
  ++state_;
  const size_t patches = surface.patches().size();
  box_states_.resize(patches, 0);
  shape_states_.resize(patches, 0);
  surroundings_states_.resize(patches, 0);
  const auto check = [&budget] { budget.Check(); };
  ResizeInPieces(surroundings_, patches, check);
  ResizeInPieces(patch_boxes_, patches, check);
  ResizeInPieces(shapes_, patches, check);
  ResizeInPieces(edge_boxes_, surface.patch_edges().size(), check);
  ResizeInPieces(triangle_boxes_, surface.patch_triangles().size(), check);
}

template <class V>
Box<V> PairSearch<V>::BoxOf(std::span<const uint32_t> particles) const {
  Box<V> box;
  for (const uint32_t i : particles) box.Add(positions_[i]);
  return box;
}

template <class V>
void PairSearch<V>::MakeBoxes(uint32_t p) {
  if (box_states_[p] == state_) return;
  box_states_[p] = state_;
  const ContactPatch& patch = surface_->patches()[p];
  patch_boxes_[p] = BoxOf(surface_->corners_of(patch));
  size_t place = patch.edge_begin;
  for (const uint32_t e : surface_->edges_of(patch)) {
    edge_boxes_[place++] = BoxOf(surface_->edges()[e]);
  }
  place = patch.triangle_begin;
  for (const uint32_t t : surface_->triangles_of(patch)) {
    triangle_boxes_[place++] = BoxOf(surface_->triangles()[t]);
  }
}

template <class V>
typename PairSearch<V>::Real PairSearch<V>::Gap(const PatchPair& patches) {
  const auto [first, second] = patches;
  if (const ContactNeighbours* neighbours = surface_->Neighbours(first, second)) {
    return FlatGap(SurroundingsAt(first), SurroundingsAt(second), neighbours->rest_gap_m);
  }
  const PatchShape<V>& a = ShapeAt(first);
  const PatchShape<V>& b = ShapeAt(second);
  MakeBoxes(first);
  MakeBoxes(second);
  const V apart = Max(V(patch_boxes_[first].low - patch_boxes_[second].high),
                      V(patch_boxes_[second].low - patch_boxes_[first].high));
  // Layers that lie aslant are apart along their normals.
  return std::max(
      {Length(Max(apart, V{})), GapAcross(patches, a.axis), GapAcross(patches, b.axis)});
}

template <class V>
const PatchShape<V>& PairSearch<V>::ShapeAt(uint32_t p) {
  if (shape_states_[p] != state_) {
    shape_states_[p] = state_;
    shapes_[p] = ShapeOf(*surface_, surface_->patches()[p], positions_);
  }
  return shapes_[p];
}

template <class V>
const PatchShape<V>& PairSearch<V>::SurroundingsAt(uint32_t p) {
  if (surroundings_states_[p] != state_) {
    surroundings_states_[p] = state_;
    surroundings_[p] = ShapeAt(p);
    for (const uint32_t other : surface_->surroundings_of(p)) {
      AddToSurroundings(surroundings_[p], ShapeAt(other));
    }
  }
  return surroundings_[p];
}

// Between the corners of two patches along a unit vector; negative where they overlap.
template <class V>
typename PairSearch<V>::Real PairSearch<V>::GapAcross(const PatchPair& patches,
                                                      const V& axis) const {
  const std::span<const uint32_t> first = surface_->corners_of(surface_->patches()[patches.first]);
  const std::span<const uint32_t> second =
      surface_->corners_of(surface_->patches()[patches.second]);
  const V origin = positions_[first[0]];
  constexpr Real kMost = std::numeric_limits<Real>::max();
  Real low = kMost, high = -kMost, other_low = kMost, other_high = -kMost;
  for (const uint32_t i : first) {
    const Real height = Dot(axis, V(positions_[i] - origin));
    low = std::min(low, height);
    high = std::max(high, height);
  }
  for (const uint32_t i : second) {
    const Real height = Dot(axis, V(positions_[i] - origin));
    other_low = std::min(other_low, height);
    other_high = std::max(other_high, height);
  }
  return std::max(low - other_high, other_low - high);
}

// The primitives of a patch that are near a box.
template <class V>
void PairSearch<V>::Collect(uint32_t p, const Box<V>& near, NearPrimitives& found) const {
  const ContactPatch& patch = surface_->patches()[p];
  budget_->Take(patch.vertex_end - patch.vertex_begin + patch.edge_end - patch.edge_begin +
                patch.triangle_end - patch.triangle_begin);
  found.vertices.clear();
  found.vertices.Reserve(patch.vertex_end - patch.vertex_begin);
  for (uint32_t k = patch.vertex_begin; k < patch.vertex_end; ++k) {
    const V position = positions_[surface_->patch_vertices()[k]];
    found.vertices.Offer(k, AreNear({position, position}, near, margin_));
  }
  found.edges.clear();
  found.edges.Reserve(patch.edge_end - patch.edge_begin);
  for (uint32_t k = patch.edge_begin; k < patch.edge_end; ++k) {
    found.edges.Offer(k, AreNear(edge_boxes_[k], near, margin_));
  }
  found.triangles.clear();
  found.triangles.Reserve(patch.triangle_end - patch.triangle_begin);
  for (uint32_t k = patch.triangle_begin; k < patch.triangle_end; ++k) {
    found.triangles.Offer(k, AreNear(triangle_boxes_[k], near, margin_));
  }
}

template <class V>
typename PairSearch<V>::Real PairSearch<V>::Find(const PatchPair& patches, Real reach,
                                                 std::vector<CandidatePair<V>>& pairs, Real far) {
  const auto [first, second] = patches;
  pairs_ = &pairs;
  reach_ = reach;
  others_ = std::max(reach, far);
  thickness_ = thicknesses_.Of(*surface_, first, second);
  margin_ = Splat<V>(thickness_ + others_);
  const ContactNeighbours* const neighbours = surface_->Neighbours(first, second);
  may_be_near_at_rest_ =
      neighbours == nullptr
          ? surface_->MayBeNearAtRest(first, second, double{thickness_})
          : std::min(neighbours->rest_gap_m, neighbours->rest_edge_gap_m) < double{thickness_};
  MakeBoxes(first);
  MakeBoxes(second);
  Collect(first, patch_boxes_[second], first_);
  if (first == second) {
    AddVertices(first_, first_);
  } else {
    Collect(second, patch_boxes_[first], second_);
    AddVertices(first_, second_);
    AddVertices(second_, first_);
  }
  AddEdges(patches);
  return others_;
}

// Of vertices of the first and triangles of the second.
template <class V>
void PairSearch<V>::AddVertices(const NearPrimitives& first, const NearPrimitives& second) {
  near_boxes_.clear();
  near_boxes_.Reserve(first.vertices.size() * second.triangles.size());
  budget_->Take(first.vertices.size() * second.triangles.size());
  for (const uint32_t vertex : first.vertices.entries()) {
    const uint32_t i = surface_->patch_vertices()[vertex];
    const Box<V> box{positions_[i], positions_[i]};
    for (const uint32_t triangle : second.triangles.entries()) {
      const auto& [j, k, l] = surface_->triangles()[surface_->patch_triangles()[triangle]];
      const bool has_common = (i == j) | (i == k) | (i == l);
      near_boxes_.Offer({i, j, k, l},
                        AreNear(box, triangle_boxes_[triangle], margin_) & !has_common);
    }
  }
  AddNear(PairKind::kVertexTriangle);
}

// Of those with boxes near each other those that are near.
template <class V>
void PairSearch<V>::AddNear(PairKind kind) {
  constexpr Real kMost = std::numeric_limits<Real>::max();
  const Real limit = thickness_ + reach_;
  V others = V{} + kMost;  // distances
  const auto candidates = near_boxes_.entries();
  budget_->Take(kDistanceLooks * candidates.size());
  for (size_t begin = 0; begin < candidates.size(); begin += kPairsSideBySide) {
    const size_t count = std::min(kPairsSideBySide, candidates.size() - begin);
    FourPairs pairs;
    for (size_t lane = 0; lane < kPairsSideBySide; ++lane) {
      pairs[lane] = &candidates[begin + std::min(lane, count - 1)];
    }
    const auto difference = Closest<V>(kind, CornersOf(pairs, positions_.data())).difference;
    const V distances = RootOf(Dot(difference, difference));
    const auto are_near = distances <= limit;
    const uint32_t near = BitsOf(are_near) & ((1u << count) - 1);
    others = Smaller(others, are_near ? V{} + kMost : distances);
    for (uint32_t bits = near; bits != 0; bits &= bits - 1) {
      const int lane = std::countr_zero(bits);
      Add(kind, *pairs[lane], distances[lane]);
    }
  }
  for (int lane = 0; lane < 4; ++lane) others_ = std::min(others_, others[lane] - thickness_);
}

template <class V>
void PairSearch<V>::AddEdges(const PatchPair& patches) {
  const bool is_one = patches.first == patches.second;
  const std::span<const uint32_t> firsts = first_.edges.entries();
  const std::span<const uint32_t> others = is_one ? firsts : second_.edges.entries();
  near_boxes_.clear();
  near_boxes_.Reserve(firsts.size() * others.size());
  budget_->Take(firsts.size() * others.size());
  for (size_t k = 0; k < firsts.size(); ++k) {
    const auto& [i, j] = surface_->edges()[surface_->patch_edges()[firsts[k]]];
    const Box<V> box = edge_boxes_[firsts[k]];
    for (size_t l = is_one ? k + 1 : 0; l < others.size(); ++l) {
      const auto& [m, n] = surface_->edges()[surface_->patch_edges()[others[l]]];
      const bool has_common = (i == m) | (i == n) | (j == m) | (j == n);
      near_boxes_.Offer({i, j, m, n}, AreNear(box, edge_boxes_[others[l]], margin_) & !has_common);
    }
  }
  AddNear(PairKind::kEdges);
}

template <class V>
void PairSearch<V>::Add(PairKind kind, const std::array<uint32_t, 4>& particles, Real distance) {
  const auto touch = static_cast<Real>(
      TouchDistance_m(*surface_, kind, particles, double{thickness_}, may_be_near_at_rest_));
  if (distance > touch + reach_) {
    others_ = std::min(others_, distance - touch);
    return;
  }
  pairs_->push_back({particles, kind, touch, distance});
}

template class PairSearch<Vector3f>;
template class PairSearch<Vector3d>;

}  // namespace drape::self_contact
