#include "server/solver/self_contact/patch_search.h"

#include <algorithm>

namespace drape::self_contact {

size_t MostPatchPairs(const ContactSurface& surface) {
  constexpr size_t kOfSmallCloth = 32768, kPerPatch = 128, kOfAny = size_t{1} << 23;
  return std::clamp(kPerPatch * surface.patches().size(), kOfSmallCloth, kOfAny);
}

template <class V>
bool PatchSearch<V>::Find(const ContactSurface& surface, const SearchState<V>& state,
                          Real thickness, SearchBudget& budget, std::vector<PatchPair>& pairs) {
  pairs.clear();
  if (surface.patches().empty()) return true;
  surface_ = &surface;
  state_ = state;
  thickness_ = thickness;
  pairs_ = &pairs;
  most_pairs_ = MostPatchPairs(surface);
  Prepare(budget);
  SearchNeighbours();
  budget.Check();
  budget.Take(kNodePairLooks * surface.neighbours().size());
  SearchTree(budget);
  if (pairs.size() > most_pairs_ || budget.is_spent()) return false;
  budget.Check();
  Sort();
  budget.Check();
  return true;
}

template <class V>
void PatchSearch<V>::Prepare(SearchBudget& budget) {
  const std::span<const ContactPatch> patches = surface_->patches();
  const auto check = [&budget] { budget.Check(); };
  ResizeInPieces(shapes_, patches.size(), check);
  ResizeInPieces(patches_, patches.size(), check);
  constexpr size_t kBetweenChecks = 1u << 13;
  for (size_t p = 0; p < patches.size(); ++p) {
    if (p % kBetweenChecks == 0) budget.Check();
    shapes_[p] = ShapeOf(*surface_, patches[p], state_.positions);
    NodeState state;
    for (const uint32_t i : surface_->corners_of(patches[p])) {
      state.positions.Add(state_.positions[i]);
      state.velocities.Add(state_.velocities[i]);
    }
    patches_[p] = state;
  }
  budget.Check();
  surroundings_ = shapes_;
  budget.Check();
  for (const ContactNeighbours& pair : surface_->neighbours()) {
    AddToSurroundings(surroundings_[pair.first], shapes_[pair.second]);
    AddToSurroundings(surroundings_[pair.second], shapes_[pair.first]);
  }
  budget.Check();
  const std::span<const ContactNode> nodes = surface_->nodes();
  nodes_.resize(nodes.size());
  for (size_t k = nodes.size(); k-- > 0;) {  // children come after their parents
    if (nodes[k].first_child == 0) {
      nodes_[k] = patches_[nodes[k].patch];
    } else {
      nodes_[k] = nodes_[nodes[k].first_child];
      nodes_[k].positions.Add(nodes_[nodes[k].first_child + 1].positions);
      nodes_[k].velocities.Add(nodes_[nodes[k].first_child + 1].velocities);
    }
  }
}

template <class V>
V PatchSearch<V>::Approach(const Box<V>& velocities, const Box<V>& other_velocities) const {
  const V faster = Abs(V(velocities.high - other_velocities.low));
  const V slower = Abs(V(velocities.low - other_velocities.high));
  return state_.duration * Max(faster, slower);
}

template <class V>
void PatchSearch<V>::SearchTree(SearchBudget& budget) {
  const std::span<const ContactNode> nodes = surface_->nodes();
  const V reach = Splat<V>(thickness_ + state_.drift);
  // Nodes beside the path to a leaf, for each of two.
  open_.resize(4 * nodes.size() + 4);
  size_t count = 0;
  const auto open = [&](uint32_t a, uint32_t b) {
    const V margin = reach + Approach(nodes_[a].velocities, nodes_[b].velocities);
    if (AreNear(nodes_[a].positions, nodes_[b].positions, margin)) open_[count++] = {a, b};
  };
  open_[count++] = {0, 0};
  while (count > 0 && pairs_->size() <= most_pairs_ && !budget.is_spent()) {
    budget.Take(kNodePairLooks);
    const auto [a, b] = open_[--count];
    if (!surface_->MayTouchBelow(a, b)) continue;
    const uint32_t child_a = nodes[a].first_child, child_b = nodes[b].first_child;
    if (a == b) {
      if (child_a == 0) continue;
      open_[count++] = {child_a, child_a};
      open_[count++] = {child_a + 1, child_a + 1};
      open(child_a, child_a + 1);
    } else if (child_a == 0 && child_b == 0) {
      const auto [first, second] = std::minmax(nodes[a].patch, nodes[b].patch);
      if (!surface_->AreNeighbours(first, second)) pairs_->push_back({first, second});
    } else if (child_b == 0 || (child_a != 0 && a < b)) {
      open(child_a, b);
      open(child_a + 1, b);
    } else {
      open(a, child_b);
      open(a, child_b + 1);
    }
  }
}

template <class V>
void PatchSearch<V>::SearchNeighbours() {
  for (const ContactNeighbours& neighbours : surface_->neighbours()) {
    const uint32_t first = neighbours.first, second = neighbours.second;
    const Real gap = FlatGap(surroundings_[first], surroundings_[second], neighbours.rest_gap_m);
    if (gap > thickness_ + state_.drift) {
      const V approach = Approach(patches_[first].velocities, patches_[second].velocities);
      if (gap > thickness_ + state_.drift + Length(approach)) continue;
    }
    pairs_->push_back({first, second});
  }
}

// By first patches, then each of those by second ones.
template <class V>
void PatchSearch<V>::Sort() {
  offsets_.assign(surface_->patches().size() + 1, 0);
  for (const PatchPair& pair : *pairs_) ++offsets_[pair.first + 1];
  for (size_t p = 1; p < offsets_.size(); ++p) offsets_[p] += offsets_[p - 1];
  sorted_.resize(pairs_->size());
  for (const PatchPair& pair : *pairs_) sorted_[offsets_[pair.first]++] = pair;
  auto begin = sorted_.begin();
  while (begin != sorted_.end()) {
    auto end = begin;
    while (end != sorted_.end() && end->first == begin->first) ++end;
    std::sort(begin, end);
    begin = end;
  }
  pairs_->swap(sorted_);
}

template class PatchSearch<Vector3f>;
template class PatchSearch<Vector3d>;

}  // namespace drape::self_contact
