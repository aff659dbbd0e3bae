#include "server/solver/surface_contact/four_parts.h"

#include <span>

#include "server/solver/surface_contact/sharp_solid.h"
#include "server/solver/surface_contact/tangents.h"
#include "server/solver/surface_contact/triangle_weights.h"

namespace drape::surface_contact {
namespace {

using self_contact::BitsOf;

// Those that are known, and of which nothing is inside.
template <class V>
FourLowest<V> KnownOf(uint32_t known, const V& free) {
  FourLowest<V> four{.known = known};
  for (size_t k = 0; k < kFour; ++k) {
    four.lowest[k].room = four.lowest[k].gap = free[static_cast<int>(k)];
  }
  return four;
}

// As LowestOnEdge, and NextOnEdge unless that has to solve for a place.
template <class V, class Shape>
FourLowest<V> OnFourEdges(const Shape& shape, ScalarOf<V> offset,
                          const CornersOfFour<V, 2>& corners, ScalarOf<V> least,
                          ScalarOf<V> expected) {
  using Real = ScalarOf<V>;
  using Mask = MaskOf<FourVectors<V>>;
  const V zero{};
  FourVectors<V> a = SideBySide(corners[0]), b = SideBySide(corners[1]);
  const FourVectors<V> beyond = (b - a) * OfAll<V>(kOverlap);
  a = a - beyond;
  b = b + beyond;
  const FourVectors<V> d = b - a;
  const auto at = [&](const FourVectors<V>& x) { return shape.At(shape.PlaceOf(x)); };
  const Tangent<FourVectors<V>> low = TangentAt(at, a, d, zero);
  const Tangent<FourVectors<V>> high = TangentAt(at, a, d, OfAll<V>(1));
  V gap = self_contact::Min(low.at.gap, high.at.gap);
  V room{};
  const auto is_level = low.slope == high.slope;
  if (IsAnySet(is_level)) {
    const std::array ends{a, b};
    const V above = RoomAbove<FourVectors<V>>(shape, std::span(ends));
    room = is_level ? above : zero;
  }

  const auto has_length = Dot(d, d) > zero;
  const Mask falls_inwards = has_length & (low.slope < zero) & (high.slope > zero);
  Dip<FourVectors<V>> dip;
  if (IsAnySet(falls_inwards)) {
    dip = DipByTangents(at, offset, a, d, low, high, least, zero, falls_inwards);
    gap = falls_inwards ? dip.gap : gap;
  }
  // Whether NextOnEdge looks for the place where the others leave a face.
  const V level = OfAll<V>(kNearlyLevel) * Length(d);
  const auto leaves_at_low =
      (self_contact::Abs(low.slope) < level) & (high.slope > low.slope + level);
  const auto leaves_at_high =
      (self_contact::Abs(high.slope) < level) & (low.slope < high.slope - level);
  const auto is_asked = ~dip.is_inside & ~(gap > expected) & ~(room > zero);
  const Mask is_known = has_length & ~(is_asked & (leaves_at_low | leaves_at_high));
  FourLowest<V> four = KnownOf<V>(BitsOf(is_known), self_contact::Max(room, gap));
  const uint32_t inside = BitsOf(dip.is_inside);
  const std::array<V, kFour> normals = Apart(dip.normal);
  for (size_t k = 0; k < kFour; ++k) {
    if ((inside >> k & 1) == 0) continue;
    const auto lane = static_cast<int>(k);
    const Real place = PlaceOnShorter(dip.place[lane]);
    four.lowest[k] = LowestPoint<V>{true, {1 - place, place, 0}, normals[k], gap[lane]};
  }
  return four;
}

// As LowestOnTriangle where nothing is inside, unless LowestCornerUnder finds something.
template <class V, class Shape>
FourLowest<V> OnFourTriangles(const Shape& shape, ScalarOf<V> offset,
                              const CornersOfFour<V, 3>& corners, ScalarOf<V> expected) {
  using Mask = MaskOf<FourVectors<V>>;
  const std::array<FourVectors<V>, 3> at{SideBySide(corners[0]), SideBySide(corners[1]),
                                         SideBySide(corners[2])};
  const V room = RoomAbove<FourVectors<V>>(shape, std::span(at));
  const FourVectors<V> cross = Cross(at[1] - at[0], at[2] - at[0]);
  const V twice_area = Length(cross);
  const auto has_area = twice_area > 0;
  const Mask has_room = has_area & (room > 0);
  if (AreAllSet(has_room)) return KnownOf<V>(BitsOf(has_room), room);

  const FourVectors<V> normal = cross / twice_area;
  const auto gap_along = [&](const FourVectors<V>& n, const FourVectors<V>& x) {
    return V(Dot(n, at[0] - x) - offset);
  };
  const FourVectors<V> farthest = shape.Farthest(normal), farthest_back = shape.Farthest(-normal);
  const V gap_ahead = gap_along(normal, farthest), gap_back = gap_along(-normal, farthest_back);
  const auto is_back = gap_back > gap_ahead;
  const V gap = is_back ? gap_back : gap_ahead;
  Mask may_be = AreInside(WeightsAt(at, Select(is_back, farthest_back, farthest)), -kOverlap);
  // Whether LowestCornerUnder finds something that is near enough.
  const Mask is_asked = ~may_be & ~(gap > expected) & ~has_room;
  if (IsAnySet(is_asked)) {
    const FourVectors<V> up = Select(is_back, -normal, normal);
    shape.ForNearlyFarthest(up, [&](const Mask& is_far, const FourVectors<V>& corner) {
      may_be |= is_asked & is_far & AreInside(WeightsAt(at, corner), -kOverlap) &
                (gap_along(up, corner) <= expected);
    });
  }
  const Mask is_known = has_area & (has_room | ~may_be);
  return KnownOf<V>(BitsOf(is_known), has_room ? room : self_contact::Max(V{}, gap));
}

}  // namespace

template <class V>
FourLowest<V> LowestOnFourEdges(const Solid<V>& solid, const CornersOfFour<V, 2>& corners,
                                ScalarOf<V> least, ScalarOf<V> expected) {
  return WithSharp<FourVectors<V>>(solid, [&](const auto& shape) {
    return OnFourEdges(shape, solid.offset(), corners, least, expected);
  });
}

template <class V>
FourLowest<V> LowestOnFourTriangles(const Solid<V>& solid, const CornersOfFour<V, 3>& corners,
                                    ScalarOf<V> expected) {
  return WithSharp<FourVectors<V>>(solid, [&](const auto& shape) {
    return OnFourTriangles(shape, solid.offset(), corners, expected);
  });
}

#define DRAPE_FOUR(V)                                                                       \
  template FourLowest<V> LowestOnFourEdges(const Solid<V>&, const CornersOfFour<V, 2>&,     \
                                           ScalarOf<V>, ScalarOf<V>);                       \
  template FourLowest<V> LowestOnFourTriangles(const Solid<V>&, const CornersOfFour<V, 3>&, \
                                               ScalarOf<V>)
DRAPE_FOUR(self_contact::Vector3f);
DRAPE_FOUR(self_contact::Vector3d);
#undef DRAPE_FOUR

}  // namespace drape::surface_contact
