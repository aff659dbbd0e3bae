// Finds the pairs of vertices and triangles, and of edges, of two patches that are near each other.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/solver/self_contact/closest_side_by_side.h"
#include "server/solver/self_contact/contact_surface.h"
#include "server/solver/self_contact/filtered_list.h"
#include "server/solver/self_contact/patch_search.h"
#include "server/solver/self_contact/patch_shape.h"
#include "server/solver/self_contact/vectors.h"

namespace drape::self_contact {

template <class V>
struct CandidatePair {
  std::array<uint32_t, 4> particles;
  PairKind kind;
  ScalarOf<V> touch;     // distance at which it touches [m]
  ScalarOf<V> distance;  // when it was found [m]
};

// Edges touch at this share of the thickness [-]. Smooth layers rest on the vertices alone then,
// which takes far less time; larger: edges carry too, and layers that are not smooth are thicker.
inline constexpr double kEdgeShare = 0.875;
// Pairs that are nearer than the thickness in the rest shape touch at this share of their distance
// there [-]. Larger: cloth with fine cells stiffens; smaller: its folds are sharper.
inline constexpr double kRestShare = 0.5;

// The distance at which a pair touches [m], for a cloth of some thickness.
double TouchDistance_m(const ContactSurface& surface, PairKind kind,
                       const std::array<uint32_t, 4>& particles, double thickness_m,
                       bool may_be_near_at_rest);

// Searches within one state after the other; a search depends on its state alone. One thread.
template <class V>
class PairSearch {
 public:
  using Real = ScalarOf<V>;

  // The state in which to search, until the next one. `positions` [particle_count] [m]. `budget`:
  // what a search costs is taken from it, but no search is left undone; it outlives the state.
  void Begin(const ContactSurface& surface, std::span<const V> positions,
             const Thicknesses<Real>& thicknesses, SearchBudget& budget);

  // Primitives without a common vertex of the two patches are no nearer than this [m].
  Real Gap(const PatchPair& patches);
  // Adds every such pair that is no farther than the distance at which it touches and `reach` [m],
  // always in the same order. How much farther than that all others are at least [m]: at most
  // `far`, or `reach` if that is larger.
  Real Find(const PatchPair& patches, Real reach, std::vector<CandidatePair<V>>& pairs,
            Real far = 0);

 private:
  // Of a patch what is near a box: places in its lists.
  struct NearPrimitives {
    FilteredList<uint32_t> vertices, edges, triangles;
  };

  const PatchShape<V>& ShapeAt(uint32_t patch);
  const PatchShape<V>& SurroundingsAt(uint32_t patch);
  Real GapAcross(const PatchPair& patches, const V& axis) const;
  Box<V> BoxOf(std::span<const uint32_t> particles) const;
  void MakeBoxes(uint32_t patch);
  void Collect(uint32_t patch, const Box<V>& near, NearPrimitives& found) const;
  void AddVertices(const NearPrimitives& first, const NearPrimitives& second);
  void AddEdges(const PatchPair& patches);
  void AddNear(PairKind kind);
  void Add(PairKind kind, const std::array<uint32_t, 4>& particles, Real distance);

  const ContactSurface* surface_ = nullptr;
  SearchBudget* budget_ = nullptr;
  std::span<const V> positions_;
  Thicknesses<Real> thicknesses_;
  // What is known of patches in this state.
  uint64_t state_ = 0;
  // Of each patch: the last state it is of.
  std::vector<uint64_t> box_states_, shape_states_, surroundings_states_;
  std::vector<Box<V>> patch_boxes_;                   // of each patch
  std::vector<Box<V>> edge_boxes_, triangle_boxes_;   // in the order of the patches' lists
  std::vector<PatchShape<V>> shapes_, surroundings_;  // of each patch
  // Of the two patches that are searched.
  NearPrimitives first_, second_;
  FilteredList<std::array<uint32_t, 4>> near_boxes_;  // pairs with boxes near each other
  Real thickness_ = 0, reach_ = 0;
  Real others_ = 0;  // what Find returns
  V margin_{};
  bool may_be_near_at_rest_ = false;
  std::vector<CandidatePair<V>>* pairs_ = nullptr;
};

extern template class PairSearch<Vector3f>;
extern template class PairSearch<Vector3d>;

}  // namespace drape::self_contact
