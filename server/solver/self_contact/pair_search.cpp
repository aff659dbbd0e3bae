#include "server/solver/self_contact/pair_search.h"

#include <algorithm>
#include <cmath>

namespace drape::self_contact {
namespace {

// Neighbouring patches are flat if no normal is farther than this from their axes, and those not
// from each other [-, cosine]: three times 19 degrees. What does not share a vertex is then apart
// by at least kFlatShare of its distance in the rest shape, times the share of the area that is
// left of the triangle that lost most (shear brings rows together) [-]. Larger shares: pairs of
// folds are missed; smaller ones: pairs of flat cloth are looked at in vain.
constexpr double kFlatCosine = 0.945;
constexpr double kFlatShare = 0.6;

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
bool PairSearch<V>::Find(const ContactSurface& surface, const SearchState<V>& state, Real thickness,
                         size_t most_pairs, std::vector<CandidatePair<V>>& pairs) {
  pairs.clear();
  if (surface.patches().empty()) return true;
  most_pairs_ = most_pairs;
  surface_ = &surface;
  state_ = state;
  thickness_ = thickness;
  pairs_ = &pairs;
  Prepare();
  SearchNeighbours();
  SearchTree();
  return pairs.size() <= most_pairs;
}

template <class V>
typename PairSearch<V>::PatchState PairSearch<V>::StateOf(const ContactPatch& patch) const {
  PatchState result;
  for (const uint32_t i : surface_->corners_of(patch)) {
    result.positions.Add(state_.positions[i]);
    result.velocities.Add(state_.velocities[i]);
  }
  std::array<V, 16> normals{};
  size_t count = 0;
  V sum{};
  result.area_share = 1;
  for (const uint32_t t : surface_->triangles_of(patch)) {
    const auto& [i, j, k] = surface_->triangles()[t];
    const V a = state_.positions[i];
    const V cross = Cross(V(state_.positions[j] - a), V(state_.positions[k] - a));
    const Real double_area = Length(cross);
    const auto rest = static_cast<Real>(surface_->rest_double_area_m2(t));
    result.area_share = std::min(result.area_share, rest > 0 ? double_area / rest : Real{0});
    normals[count] = double_area > 0 ? V(cross / double_area) : V{};
    sum += normals[count++];
  }
  const Real length = Length(sum);
  result.axis = length > 0 ? V(sum / length) : V{};
  result.min_cosine = 1;
  for (size_t k = 0; k < count; ++k) {
    result.min_cosine = std::min(result.min_cosine, Dot(normals[k], result.axis));
  }
  return result;
}

template <class V>
void PairSearch<V>::Prepare() {
  patches_.clear();
  for (const ContactPatch& patch : surface_->patches()) patches_.push_back(StateOf(patch));
  const std::span<const ContactNode> nodes = surface_->nodes();
  nodes_.resize(nodes.size());
  for (size_t k = nodes.size(); k-- > 0;) {  // children come after their parents
    if (nodes[k].first_child == 0) {
      const PatchState& patch = patches_[nodes[k].patch];
      nodes_[k] = {patch.positions, patch.velocities};
    } else {
      nodes_[k] = nodes_[nodes[k].first_child];
      nodes_[k].positions.Add(nodes_[nodes[k].first_child + 1].positions);
      nodes_[k].velocities.Add(nodes_[nodes[k].first_child + 1].velocities);
    }
  }
}

template <class V>
V PairSearch<V>::Approach(const Box<V>& velocities, const Box<V>& other_velocities) const {
  const V faster = Abs(V(velocities.high - other_velocities.low));
  const V slower = Abs(V(velocities.low - other_velocities.high));
  return state_.duration * Max(faster, slower);
}

template <class V>
void PairSearch<V>::SearchTree() {
  const std::span<const ContactNode> nodes = surface_->nodes();
  open_.assign(1, {0, 0});
  while (!open_.empty()) {
    const auto [a, b] = open_.back();
    open_.pop_back();
    const uint32_t child_a = nodes[a].first_child, child_b = nodes[b].first_child;
    if (a == b) {
      if (child_a != 0) {
        open_.insert(open_.end(),
                     {{child_a, child_a}, {child_a + 1, child_a + 1}, {child_a, child_a + 1}});
      }
      continue;
    }
    const V margin = Margin(Approach(nodes_[a].velocities, nodes_[b].velocities));
    if (!AreNear(nodes_[a].positions, nodes_[b].positions, margin)) continue;
    if (child_a == 0 && child_b == 0) {
      const auto [first, second] = std::minmax(nodes[a].patch, nodes[b].patch);
      if (!surface_->AreNeighbours(first, second)) SearchPatches(first, second);
    } else if (child_b == 0 || (child_a != 0 && a < b)) {
      open_.insert(open_.end(), {{child_a, b}, {child_a + 1, b}});
    } else {
      open_.insert(open_.end(), {{a, child_b}, {a, child_b + 1}});
    }
  }
}

template <class V>
void PairSearch<V>::SearchNeighbours() {
  constexpr auto kCosine = static_cast<Real>(kFlatCosine);
  for (const ContactNeighbours& neighbours : surface_->neighbours()) {
    const PatchState& a = patches_[neighbours.first];
    const PatchState& b = patches_[neighbours.second];
    const bool is_flat =
        std::min(a.min_cosine, b.min_cosine) > kCosine && Dot(a.axis, b.axis) > kCosine;
    if (is_flat) {
      const Real gap = static_cast<Real>(kFlatShare * neighbours.rest_gap_m) *
                       std::min(a.area_share, b.area_share);
      const Real approach = Length(Approach(a.velocities, b.velocities));
      if (gap > thickness_ + state_.drift + approach) continue;
    }
    SearchPatches(neighbours.first, neighbours.second);
  }
}

template <class V>
Box<V> PairSearch<V>::BoxOf(std::span<const uint32_t> particles) const {
  Box<V> box;
  for (const uint32_t i : particles) box.Add(state_.positions[i]);
  return box;
}

// The primitives of a patch that are near the box of the other one.
template <class V>
void PairSearch<V>::Collect(const ContactPatch& patch, const Box<V>& near, const V& margin,
                            Boxed& boxed) const {
  const auto collect = [&](std::span<const uint32_t> indices, std::vector<BoxedPrimitive>& list,
                           const auto& box_of) {
    list.clear();
    for (const uint32_t index : indices) {
      const Box<V> box = box_of(index);
      if (AreNear(box, near, margin)) list.push_back({index, box});
    }
  };
  collect(surface_->vertices_of(patch), boxed.vertices,
          [&](uint32_t i) { return BoxOf(std::span(&i, 1)); });
  collect(surface_->edges_of(patch), boxed.edges,
          [&](uint32_t e) { return BoxOf(surface_->edges()[e]); });
  collect(surface_->triangles_of(patch), boxed.triangles,
          [&](uint32_t t) { return BoxOf(surface_->triangles()[t]); });
}

template <class V>
void PairSearch<V>::SearchPatches(uint32_t first, uint32_t second) {
  if (pairs_->size() > most_pairs_) return;
  const PatchState& a = patches_[first];
  const PatchState& b = patches_[second];
  const V approach = Approach(a.velocities, b.velocities);
  margin_ = Margin(approach);
  approach_ = Length(approach);
  may_be_near_at_rest_ = surface_->MayBeNearAtRest(first, second, double{thickness_});
  const ContactPatch& first_patch = surface_->patches()[first];
  Collect(first_patch, b.positions, margin_, first_);
  if (first == second) {
    AddVertices(first_, first_);
  } else {
    Collect(surface_->patches()[second], a.positions, margin_, second_);
    AddVertices(first_, second_);
    AddVertices(second_, first_);
  }
  const std::vector<BoxedPrimitive>& others = first == second ? first_.edges : second_.edges;
  for (size_t k = 0; k < first_.edges.size(); ++k) {
    for (size_t l = first == second ? k + 1 : 0; l < others.size(); ++l) {
      if (!AreNear(first_.edges[k].box, others[l].box, margin_)) continue;
      const auto& [i, j] = surface_->edges()[first_.edges[k].index];
      const auto& [m, n] = surface_->edges()[others[l].index];
      if (i == m || i == n || j == m || j == n) continue;
      Add(PairKind::kEdges, {i, j, m, n});
    }
  }
}

template <class V>
void PairSearch<V>::AddVertices(const Boxed& vertices, const Boxed& triangles) {
  for (const BoxedPrimitive& vertex : vertices.vertices) {
    for (const BoxedPrimitive& triangle : triangles.triangles) {
      if (!AreNear(vertex.box, triangle.box, margin_)) continue;
      const uint32_t i = vertex.index;
      const auto& [j, k, l] = surface_->triangles()[triangle.index];
      if (i == j || i == k || i == l) continue;
      Add(PairKind::kVertexTriangle, {i, j, k, l});
    }
  }
}

template <class V>
void PairSearch<V>::Add(PairKind kind, const std::array<uint32_t, 4>& particles) {
  const std::span<const V> p = state_.positions;
  const Real distance =
      Length(Closest<V>(kind, {p[particles[0]], p[particles[1]], p[particles[2]], p[particles[3]]})
                 .difference);
  if (distance - thickness_ - state_.drift > approach_) return;
  const auto touch = static_cast<Real>(
      TouchDistance_m(*surface_, kind, particles, double{thickness_}, may_be_near_at_rest_));
  const Real slack = distance - touch - state_.drift;
  if (slack > approach_) return;
  pairs_->push_back({particles, kind, touch, distance,
                     slack > 0 ? state_.duration * (slack / approach_) : Real{0}});
}

template class PairSearch<Vector3f>;
template class PairSearch<Vector3d>;

}  // namespace drape::self_contact
