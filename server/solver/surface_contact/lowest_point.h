// Where an edge or a triangle is lowest above a solid, if that is inside of it. Pure.
#pragma once

#include <array>
#include <vector>

#include "server/solver/surface_contact/solid.h"

namespace drape::surface_contact {

template <class V>
struct LowestPoint {
  using Real = ScalarOf<V>;

  // The distance is less than at its ends, or its rim.
  bool is_inside = false;
  std::array<Real, 3> weights{};  // of the ends or corners
  // Unit, across the edge or triangle; `gap` from the plane across it that the solid lies behind,
  // as far as the distance is convex [m]. If it is not inside the gap is a bound: nothing of the
  // edge or triangle is nearer.
  V normal{};
  Real gap = 0;
  // As long as no particle moves farther than this relative to the solid it is not inside [m].
  Real room = 0;
};

// `least`: a dip of less below the lower end does not count [m].
template <class V>
LowestPoint<V> LowestOnEdge(const Solid<V>& solid, const V& a, const V& b, ScalarOf<V> least);

template <class V>
LowestPoint<V> LowestOnTriangle(const Solid<V>& solid, const std::array<V, 3>& corners,
                                ScalarOf<V> least);

// Where an edge whose lowest point is an end that lies nearly level on a face of the solid leaves
// that face: it comes down there next. Of a box or cylinder.
template <class V>
LowestPoint<V> NextOnEdge(const Solid<V>& solid, const V& a, const V& b, ScalarOf<V> least);

// The corner of a box or cylinder, or the end of a capsule, that is under the triangle and nearest
// along its normal, if the farthest point along it is not under the triangle: what tilts about an
// edge of the solid, which its own edges lie on, comes down on that corner next. `normal`: that of
// LowestOnTriangle; `corners_of_solid`: working memory.
template <class V>
LowestPoint<V> LowestCornerUnder(const Solid<V>& solid, const std::array<V, 3>& corners,
                                 const V& normal, std::vector<V>& corners_of_solid);

// Of a point that goes from a to b: the gap where it first meets the surface is 0, with that normal
// there. False: it does not, or starts inside.
template <class V>
bool Meets(const Solid<V>& solid, const V& a, const V& b, V& place, V& normal);

// Of an edge whose ends go straight from `starts` to `ends`: where its inside first touches a
// convex solid, to `least`. False: it does not, or starts inside.
template <class V>
bool MeetsEdge(const Solid<V>& solid, const std::array<V, 2>& starts, const std::array<V, 2>& ends,
               ScalarOf<V> least, LowestPoint<V>& lowest);

// Above round solids a triangle whose lowest point has a smaller barycentric coordinate is left to
// its edges, which are hardly higher [-]. Larger: it sinks in there, by the square of that share of
// a height over twice the radius; smaller: what lies on a ball with both pushes in turn. The
// corners of boxes and the rims of cylinders count up to the rim of a triangle.
inline constexpr double kLeastWeight = 0.02;

// An edge goes on beyond its ends, and for what is sharp a triangle beyond its rim, by this share
// of its length or heights [-]. So the corner of a box that passes a particle is above the edges
// and triangles on both sides for a while: cloth that lies around what is convex bends away from
// it, and what begins to push has nothing to push. Without it a particle at the corner of a box
// trembles by centimetres, pushed in turn by each triangle around it. Larger: folds that bend
// towards a corner keep off it, by that share; smaller: such particles tremble again.
inline constexpr double kOverlap = 0.005;

#define DRAPE_EXTERN_LOWEST(V)                                                                   \
  extern template LowestPoint<V> LowestOnEdge(const Solid<V>&, const V&, const V&, ScalarOf<V>); \
  extern template LowestPoint<V> LowestOnTriangle(const Solid<V>&, const std::array<V, 3>&,      \
                                                  ScalarOf<V>);                                  \
  extern template LowestPoint<V> NextOnEdge(const Solid<V>&, const V&, const V&, ScalarOf<V>);   \
  extern template LowestPoint<V> LowestCornerUnder(const Solid<V>&, const std::array<V, 3>&,     \
                                                   const V&, std::vector<V>&);                   \
  extern template bool Meets(const Solid<V>&, const V&, const V&, V&, V&);                       \
  extern template bool MeetsEdge(const Solid<V>&, const std::array<V, 2>&,                       \
                                 const std::array<V, 2>&, ScalarOf<V>, LowestPoint<V>&)
DRAPE_EXTERN_LOWEST(self_contact::Vector3f);
DRAPE_EXTERN_LOWEST(self_contact::Vector3d);
#undef DRAPE_EXTERN_LOWEST

}  // namespace drape::surface_contact
