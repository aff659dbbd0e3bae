#include "server/solver/self_contact/pair_search.h"

#include <algorithm>
#include <cmath>

namespace drape::self_contact {
namespace {

// Pairs of edges whose distances are computed side by side: numbers in a vector.
constexpr size_t kSideBySide = 4;
// By how much these distances may differ from those computed one by one, relative to them [-]:
// far more than rounding, far less than what would cost time.
template <class Real>
constexpr Real kLimitMargin = 1024 * std::numeric_limits<Real>::epsilon();

// One coordinate after the other of a corner of each pair.
template <class V>
struct CornersSideBySide {
  V x, y, z;
};
template <class V>
CornersSideBySide<V> operator-(const CornersSideBySide<V>& a, const CornersSideBySide<V>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class V>
V DotSideBySide(const CornersSideBySide<V>& a, const CornersSideBySide<V>& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
template <class V>
V ClampedSideBySide(const V& value) {
  return Max(Min(value, V{1, 1, 1, 1}), V{});
}

// As ClosestOfEdges.
template <class V>
V SquaredDistances(const V* positions,
                   const std::array<const std::array<uint32_t, 4>*, kSideBySide>& pairs) {
  using Real = ScalarOf<V>;
  std::array<CornersSideBySide<V>, 4> p;
  for (size_t k = 0; k < 4; ++k) {
    const V a = positions[(*pairs[0])[k]], b = positions[(*pairs[1])[k]];
    const V c = positions[(*pairs[2])[k]], d = positions[(*pairs[3])[k]];
    p[k] = {V{a[0], b[0], c[0], d[0]}, V{a[1], b[1], c[1], d[1]}, V{a[2], b[2], c[2], d[2]}};
  }
  constexpr Real kTiny = std::numeric_limits<Real>::min();
  constexpr Real kParallel = 16 * std::numeric_limits<Real>::epsilon();
  const auto d1 = p[1] - p[0], d2 = p[3] - p[2], r = p[0] - p[2];
  const V a = DotSideBySide(d1, d1) + kTiny, e = DotSideBySide(d2, d2) + kTiny;
  const V b = DotSideBySide(d1, d2), c = DotSideBySide(d1, r), f = DotSideBySide(d2, r);
  const V denominator = a * e - b * b;
  const V half{Real{0.5}, Real{0.5}, Real{0.5}, Real{0.5}};
  V s =
      denominator > kParallel * a * e ? ClampedSideBySide(V((b * f - c * e) / denominator)) : half;
  const V t = ClampedSideBySide(V((b * s + f) / e));
  s = ClampedSideBySide(V((b * t - c) / a));
  const CornersSideBySide<V> difference{(r.x + s * d1.x) - t * d2.x, (r.y + s * d1.y) - t * d2.y,
                                        (r.z + s * d1.z) - t * d2.z};
  return DotSideBySide(difference, difference);
}

}  // namespace

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
                          const Thicknesses<Real>& thicknesses) {
  surface_ = &surface;
  positions_ = positions;
  thicknesses_ = thicknesses;
  ++state_;
  const size_t patches = surface.patches().size();
  box_states_.resize(patches, 0);
  shape_states_.resize(patches, 0);
  patch_boxes_.resize(patches);
  shapes_.resize(patches);
  edge_boxes_.resize(surface.patch_edges().size());
  triangle_boxes_.resize(surface.patch_triangles().size());
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
  const PatchShape<V>& a = ShapeAt(first);
  const PatchShape<V>& b = ShapeAt(second);
  if (const ContactNeighbours* neighbours = surface_->Neighbours(first, second)) {
    return FlatGap(a, b, neighbours->rest_gap_m);
  }
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
  found.vertices.clear();
  for (uint32_t k = patch.vertex_begin; k < patch.vertex_end; ++k) {
    const V position = positions_[surface_->patch_vertices()[k]];
    if (AreNear({position, position}, near, margin_)) found.vertices.push_back(k);
  }
  found.edges.clear();
  for (uint32_t k = patch.edge_begin; k < patch.edge_end; ++k) {
    if (AreNear(edge_boxes_[k], near, margin_)) found.edges.push_back(k);
  }
  found.triangles.clear();
  for (uint32_t k = patch.triangle_begin; k < patch.triangle_end; ++k) {
    if (AreNear(triangle_boxes_[k], near, margin_)) found.triangles.push_back(k);
  }
}

template <class V>
void PairSearch<V>::Find(const PatchPair& patches, Real reach,
                         std::vector<CandidatePair<V>>& pairs) {
  const auto [first, second] = patches;
  pairs_ = &pairs;
  reach_ = reach;
  thickness_ = thicknesses_.Of(*surface_, first, second);
  margin_ = Splat<V>(thickness_ + reach);
  may_be_near_at_rest_ = surface_->MayBeNearAtRest(first, second, double{thickness_});
  MakeBoxes(first);
  MakeBoxes(second);
  Collect(first, patch_boxes_[second], first_);
  if (first == second) {
    AddVertices(first_.vertices, first_.triangles);
  } else {
    Collect(second, patch_boxes_[first], second_);
    AddVertices(first_.vertices, second_.triangles);
    AddVertices(second_.vertices, first_.triangles);
  }
  AddEdges(patches);
}

template <class V>
void PairSearch<V>::AddVertices(std::span<const uint32_t> vertices,
                                std::span<const uint32_t> triangles) {
  for (const uint32_t vertex : vertices) {
    const uint32_t i = surface_->patch_vertices()[vertex];
    const Box<V> box{positions_[i], positions_[i]};
    for (const uint32_t triangle : triangles) {
      if (!AreNear(box, triangle_boxes_[triangle], margin_)) continue;
      const auto& [j, k, l] = surface_->triangles()[surface_->patch_triangles()[triangle]];
      if (i == j || i == k || i == l) continue;
      Add(PairKind::kVertexTriangle, {i, j, k, l});
    }
  }
}

// Of those in `edges_`, without those that are farther apart.
template <class V>
void PairSearch<V>::AddNearEdges() {
  const Real limit = (thickness_ + reach_) * (1 + kLimitMargin<Real>);
  for (size_t begin = 0; begin < edges_.size(); begin += kSideBySide) {
    const size_t count = std::min(kSideBySide, edges_.size() - begin);
    std::array<const std::array<uint32_t, 4>*, kSideBySide> pairs;
    for (size_t lane = 0; lane < kSideBySide; ++lane) {
      pairs[lane] = &edges_[begin + std::min(lane, count - 1)];
    }
    const auto are_far = SquaredDistances(positions_.data(), pairs) > limit * limit;
    for (size_t lane = 0; lane < count; ++lane) {
      if (are_far[lane] == 0) Add(PairKind::kEdges, *pairs[lane]);
    }
  }
}

template <class V>
void PairSearch<V>::AddEdges(const PatchPair& patches) {
  edges_.clear();
  const bool is_one = patches.first == patches.second;
  const std::vector<uint32_t>& others = is_one ? first_.edges : second_.edges;
  for (size_t k = 0; k < first_.edges.size(); ++k) {
    const auto& [i, j] = surface_->edges()[surface_->patch_edges()[first_.edges[k]]];
    const Box<V> box = edge_boxes_[first_.edges[k]];
    for (size_t l = is_one ? k + 1 : 0; l < others.size(); ++l) {
      if (!AreNear(box, edge_boxes_[others[l]], margin_)) continue;
      const auto& [m, n] = surface_->edges()[surface_->patch_edges()[others[l]]];
      if (i == m || i == n || j == m || j == n) continue;
      edges_.push_back({i, j, m, n});
    }
  }
  AddNearEdges();
}

template <class V>
void PairSearch<V>::Add(PairKind kind, const std::array<uint32_t, 4>& particles) {
  const std::span<const V> p = positions_;
  const Real distance =
      Length(Closest<V>(kind, {p[particles[0]], p[particles[1]], p[particles[2]], p[particles[3]]})
                 .difference);
  if (distance > thickness_ + reach_) return;
  const auto touch = static_cast<Real>(
      TouchDistance_m(*surface_, kind, particles, double{thickness_}, may_be_near_at_rest_));
  if (distance > touch + reach_) return;
  pairs_->push_back({particles, kind, touch, distance});
}

template class PairSearch<Vector3f>;
template class PairSearch<Vector3d>;

}  // namespace drape::self_contact
