// Finds the pairs of vertices and triangles, and of edges, that may touch within some time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "server/solver/self_contact/closest_points.h"
#include "server/solver/self_contact/contact_surface.h"
#include "server/solver/self_contact/vectors.h"

namespace drape::self_contact {

template <class V>
struct CandidatePair {
  std::array<uint32_t, 4> particles;
  PairKind kind;
  ScalarOf<V> thickness;  // at which it touches [m]
  ScalarOf<V> distance;   // when it was found [m]
  // It does not touch earlier than this [s].
  ScalarOf<V> first_touch;
};

// The state in which to search, and how it goes on: within `duration` no particle is farther than
// `drift` from where its velocity takes it, relative to any other particle.
template <class V>
struct SearchState {
  std::span<const V> positions;   // [particle_count] [m]
  std::span<const V> velocities;  // [particle_count] [m/s]
  ScalarOf<V> duration = 0;       // [s]
  ScalarOf<V> drift = 0;          // [m]
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

// Working memory between searches; a search depends on its arguments alone. One thread.
template <class V>
class PairSearch {
 public:
  using Real = ScalarOf<V>;

  // Every pair without a common vertex that may be nearer than the distance at which it touches at
  // some time of `state`, always in the same order. `pairs` is replaced. False: there are more than
  // `most_pairs`, and some are missing.
  bool Find(const ContactSurface& surface, const SearchState<V>& state, Real thickness,
            size_t most_pairs, std::vector<CandidatePair<V>>& pairs);

 private:
  // A patch in the state of the search.
  struct PatchState {
    Box<V> positions;
    Box<V> velocities;
    V axis;           // mean of the normals of its triangles, a unit vector
    Real min_cosine;  // of a normal and the axis
    Real area_share;  // smallest area of a triangle over that at rest
  };
  struct NodeState {
    Box<V> positions;
    Box<V> velocities;
  };
  struct BoxedPrimitive {
    uint32_t index;  // of a vertex, edge or triangle
    Box<V> box;
  };
  // Primitives of two patches that are near the other patch.
  struct Boxed {
    std::vector<BoxedPrimitive> vertices, edges, triangles;
  };

  void Prepare();
  PatchState StateOf(const ContactPatch& patch) const;
  void SearchTree();
  void SearchNeighbours();
  void SearchPatches(uint32_t first, uint32_t second);
  void Collect(const ContactPatch& patch, const Box<V>& near, const V& margin, Boxed& boxed) const;
  void AddVertices(const Boxed& vertices, const Boxed& triangles);
  void Add(PairKind kind, const std::array<uint32_t, 4>& particles);
  // By how much two sets of particles may come nearer as their velocities take them, along each
  // axis.
  V Approach(const Box<V>& velocities, const Box<V>& other_velocities) const;
  // The same with the drift and the thickness.
  V Margin(const V& approach) const { return approach + Splat<V>(thickness_ + state_.drift); }
  Box<V> BoxOf(std::span<const uint32_t> particles) const;

  // Of the search under way.
  const ContactSurface* surface_ = nullptr;
  SearchState<V> state_;
  Real thickness_ = 0;
  size_t most_pairs_ = 0;
  std::vector<CandidatePair<V>>* pairs_ = nullptr;
  std::vector<PatchState> patches_;
  std::vector<NodeState> nodes_;
  std::vector<std::pair<uint32_t, uint32_t>> open_;
  Boxed first_, second_;
  // Of the two patches that are searched.
  V margin_{};
  Real approach_ = 0;  // length of Approach [m]
  bool may_be_near_at_rest_ = false;
};

extern template class PairSearch<Vector3f>;
extern template class PairSearch<Vector3d>;

}  // namespace drape::self_contact
