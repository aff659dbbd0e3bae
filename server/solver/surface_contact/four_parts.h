// Where four edges or four triangles are lowest above a box or cylinder, side by side: of most of
// them nothing is lowest inside, which takes little more time to see of four than of one. Pure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/solver/surface_contact/four_vectors.h"
#include "server/solver/surface_contact/lowest_point.h"
#include "server/solver/surface_contact/solid.h"

namespace drape::surface_contact {

// Corner c of part k: corners[c][k].
template <class V, size_t kCorners>
using CornersOfFour = std::array<std::array<V, kFour>, kCorners>;

// What LowestOnEdge and NextOnEdge, or LowestOnTriangle and LowestCornerUnder, say of four parts.
template <class V>
struct FourLowest {
  // Bit k: it is known of part k; else they have to be asked.
  uint32_t known = 0;
  // Of these. Where nothing is lowest inside, and nothing comes down next, `room` and `gap` are
  // both the larger one of the two.
  std::array<LowestPoint<V>, kFour> lowest{};
};

// Of a box or a cylinder. With the same bits as those have, in the same operations. `least`: as
// there; `expected`: what is higher comes down later [m].
template <class V>
FourLowest<V> LowestOnFourEdges(const Solid<V>& solid, const CornersOfFour<V, 2>& corners,
                                ScalarOf<V> least, ScalarOf<V> expected);
// Where something is lowest inside it is not known.
template <class V>
FourLowest<V> LowestOnFourTriangles(const Solid<V>& solid, const CornersOfFour<V, 3>& corners,
                                    ScalarOf<V> expected);

#define DRAPE_EXTERN_FOUR(V)                                                                       \
  extern template FourLowest<V> LowestOnFourEdges(const Solid<V>&, const CornersOfFour<V, 2>&,     \
                                                  ScalarOf<V>, ScalarOf<V>);                       \
  extern template FourLowest<V> LowestOnFourTriangles(const Solid<V>&, const CornersOfFour<V, 3>&, \
                                                      ScalarOf<V>)
DRAPE_EXTERN_FOUR(self_contact::Vector3f);
DRAPE_EXTERN_FOUR(self_contact::Vector3d);
#undef DRAPE_EXTERN_FOUR

}  // namespace drape::surface_contact
