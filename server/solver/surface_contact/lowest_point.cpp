#include "server/solver/surface_contact/lowest_point.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/solver/self_contact/closest_points.h"
#include "server/solver/surface_contact/tangents.h"

namespace drape::surface_contact {
namespace {

using self_contact::Clamped;
using self_contact::Cross;
using self_contact::Dot;
using self_contact::Length;

// Intervals of an edge above a distance map: of one cell each, but no more than this.
constexpr int kMostIntervals = 12;
constexpr int kMapTries = 6;
constexpr int kPathTries = 24;
constexpr int kMapPathTries = 1000;
// The shortest part of its way after which an edge is looked at again, beside what it slides along
// [-]: more of them find what it meets there more exactly and take longer.
constexpr int kWayTries = 32;

template <class V>
auto AtOf(const Solid<V>& solid) {
  return [&solid](const V& x) { return solid.At(x); };
}

template <class V>
V Across(const V& n, const V& d) {
  const V across = n - (Dot(n, d) / Dot(d, d)) * d;
  const ScalarOf<V> length = Length(across);
  return length > 0 ? V(across / length) : n;
}

template <class V>
LowestPoint<V> OnEdge(ScalarOf<V> place, const V& normal, ScalarOf<V> gap) {
  return {.is_inside = true, .weights = {1 - place, place, 0}, .normal = normal, .gap = gap};
}

template <class V>
LowestPoint<V> LowestByTangents(const Solid<V>& solid, const V& a, const V& d,
                                const Tangent<V>& low, const Tangent<V>& high, ScalarOf<V> least,
                                ScalarOf<V> tilt = 0) {
  const Dip<V> dip = DipByTangents(AtOf(solid), solid.offset(), a, d, low, high, least, tilt, true);
  if (!dip.is_inside) return {.gap = dip.gap};
  return OnEdge(dip.place, dip.normal, dip.gap);
}

// Exact: the nearest points of the edge and of the segment in the capsule.
template <class V>
LowestPoint<V> LowestAboveSegment(const Solid<V>& solid, const V& a, const V& b,
                                  ScalarOf<V> least) {
  using Real = ScalarOf<V>;
  const V d = b - a;
  Real place = 0;
  V difference{};
  if (solid.kind() == ShapeKind::kSphere) {
    place = Clamped(Dot(V(solid.segment_begin() - a), d) / Dot(d, d));
    difference = a + place * d - solid.segment_begin();
  } else {
    const V end = solid.segment_begin() + solid.segment();
    const auto closest = self_contact::ClosestOfEdges<V>({a, b, solid.segment_begin(), end});
    place = closest.weights[1];
    difference = closest.difference;
  }
  const Real distance = Length(difference);
  const Real gap = distance - solid.offset();
  if (!(place > 0 && place < 1)) return {.gap = gap};
  if (std::min(solid.At(a).gap, solid.At(b).gap) - gap <= least) return {.gap = gap};
  if (distance > std::numeric_limits<Real>::epsilon() * Length(d)) {
    return OnEdge(place, Across(V(difference / distance), d), gap);
  }
  const V across = Cross(d, solid.kind() == ShapeKind::kSphere ? V{0, 1, 0, 0} : solid.segment());
  const Real size = Length(across);
  return OnEdge(place, size > 0 ? V(across / size) : Across(V{1, 0, 0, 0}, d), gap);
}

// Not convex: the lowest of some places, and the dip around it.
template <class V>
LowestPoint<V> LowestAboveMap(const Solid<V>& solid, const V& a, const V& b, ScalarOf<V> least) {
  using Real = ScalarOf<V>;
  const V d = b - a;
  const int intervals = std::clamp(static_cast<int>(std::min(Length(d) / solid.cell(), Real{100})),
                                   2, kMostIntervals);
  std::array<Tangent<V>, kMostIntervals + 1> tried;
  int lowest = 0;
  for (int k = 0; k <= intervals; ++k) {
    tried[static_cast<size_t>(k)] =
        TangentAt(AtOf(solid), a, d, static_cast<Real>(k) / static_cast<Real>(intervals));
    if (tried[static_cast<size_t>(k)].at.gap < tried[static_cast<size_t>(lowest)].at.gap)
      lowest = k;
  }
  const Real lower_end = std::min(tried[0].at.gap, tried[static_cast<size_t>(intervals)].at.gap);
  Tangent<V> best = tried[static_cast<size_t>(lowest)];
  // Of any surface with this distance nothing between two places is lower than this.
  const Real bound = best.at.gap - Length(d) / static_cast<Real>(2 * intervals);
  Tangent<V> low = tried[static_cast<size_t>(best.slope > 0 ? std::max(lowest - 1, 0) : lowest)];
  Tangent<V> high =
      tried[static_cast<size_t>(best.slope > 0 ? lowest : std::min(lowest + 1, intervals))];
  if (!(low.slope < 0 && high.slope > 0)) {
    if (lowest == 0 || lowest == intervals) return {.gap = bound};
    low = tried[static_cast<size_t>(lowest - 1)];
    high = tried[static_cast<size_t>(lowest + 1)];
  }
  for (int k = 0; k < kMapTries && low.slope < 0 && high.slope > 0; ++k) {
    const Real secant = low.place + low.slope / (low.slope - high.slope) * (high.place - low.place);
    const Tangent<V> next =
        TangentAt(AtOf(solid), a, d, k % 2 == 0 ? secant : (low.place + high.place) / 2);
    if (next.at.gap < best.at.gap) best = next;
    (next.slope < 0 ? low : high) = next;
  }
  if (!(best.place > 0 && best.place < 1) || lower_end - best.at.gap <= least) {
    return {.gap = std::min(bound, best.at.gap - least)};
  }
  return OnEdge(best.place, Across(best.at.normal, d), best.at.gap);
}

}  // namespace

template <class V>
static LowestPoint<V> LowestBetween(const Solid<V>& solid, const V& a, const V& b,
                                    ScalarOf<V> least) {
  const V d = b - a;
  if (!(Dot(d, d) > 0)) return {.gap = solid.At(a).gap};
  if (solid.kind() == ShapeKind::kSphere || solid.kind() == ShapeKind::kCapsule) {
    return LowestAboveSegment(solid, a, b, least);
  }
  if (!solid.is_convex()) return LowestAboveMap(solid, a, b, least);
  const Tangent<V> low = TangentAt(AtOf(solid), a, d, 0), high = TangentAt(AtOf(solid), a, d, 1);
  if (low.slope < 0 && high.slope > 0) return LowestByTangents(solid, a, d, low, high, least);
  LowestPoint<V> none{.gap = std::min(low.at.gap, high.at.gap)};
  // On one face: nothing is lower inside before an end leaves it.
  if (low.slope == high.slope) none.room = solid.RoomAboveFace(std::array{a, b});
  return none;
}

// find(a, b): of an edge that goes on beyond its ends.
template <class V, class Find>
LowestPoint<V> OnLongerEdge(const V& a, const V& b, const Find& find) {
  using Real = ScalarOf<V>;
  const V beyond = static_cast<Real>(kOverlap) * (b - a);
  LowestPoint<V> lowest = find(V(a - beyond), V(b + beyond));
  const Real place = PlaceOnShorter(lowest.weights[1]);
  lowest.weights[0] = 1 - place;
  lowest.weights[1] = place;
  return lowest;
}

template <class V>
LowestPoint<V> LowestOnEdge(const Solid<V>& solid, const V& a, const V& b, ScalarOf<V> least) {
  return OnLongerEdge(a, b, [&](const V& longer_a, const V& longer_b) {
    return LowestBetween(solid, longer_a, longer_b, least);
  });
}

template <class V>
LowestPoint<V> NextOnEdge(const Solid<V>& solid, const V& a, const V& b, ScalarOf<V> least) {
  using Real = ScalarOf<V>;
  return OnLongerEdge(a, b, [&](const V& longer_a, const V& longer_b) -> LowestPoint<V> {
    const V d = longer_b - longer_a;
    const Tangent<V> low = TangentAt(AtOf(solid), longer_a, d, 0);
    const Tangent<V> high = TangentAt(AtOf(solid), longer_a, d, 1);
    const Real level = static_cast<Real>(kNearlyLevel) * Length(d);
    // The end that is nearly level, tilted by half of what still counts as that.
    if (std::abs(low.slope) < level && high.slope > low.slope + level) {
      return LowestByTangents(solid, longer_a, d, low, high, least, low.slope + level / 2);
    }
    if (std::abs(high.slope) < level && low.slope < high.slope - level) {
      return LowestByTangents(solid, longer_a, d, low, high, least, high.slope - level / 2);
    }
    return {};
  });
}

// By steps of the gap, which is no more than the way to the surface.
template <class V>
bool Meets(const Solid<V>& solid, const V& a, const V& b, V& place, V& normal) {
  using Real = ScalarOf<V>;
  const V d = b - a;
  const Real length = Length(d);
  if (!(length > 0)) return false;
  Real along = 0;
  const bool is_convex = solid.is_convex();
  for (int k = 0; k < (is_convex ? kPathTries : kMapPathTries); ++k) {
    place = a + along * d;
    const Gap<V> at = solid.At(place);
    normal = at.normal;
    if (at.gap < 0) return k > 0;
    const Real slope = Dot(normal, d);
    // Convex: it only gets farther from here on.
    if (slope >= 0 && (is_convex || !(at.gap > 0))) return false;
    if (slope < 0 && at.gap <= static_cast<Real>(1e-3) * length) {
      place -= at.gap * normal;
      return true;
    }
    // The tangent's zero is not behind the surface if that is convex, else nothing is nearer than
    // the gap.
    along += is_convex ? at.gap / -slope : std::max(at.gap / length, static_cast<Real>(1e-3));
    if (along > 1) return false;
  }
  return false;
}

// Conservative advancement (Mirtich 1996): it goes on as far as no end may use up the gap.
template <class V>
bool MeetsEdge(const Solid<V>& solid, const std::array<V, 2>& starts, const std::array<V, 2>& ends,
               ScalarOf<V> least, LowestPoint<V>& lowest) {
  using Real = ScalarOf<V>;
  const std::array<V, 2> ways{V(ends[0] - starts[0]), V(ends[1] - starts[1])};
  const Real way = std::max(Length(ways[0]), Length(ways[1]));
  if (!(way > 0)) return false;
  Real along = 0;
  while (along <= 1) {
    lowest =
        LowestOnEdge(solid, V(starts[0] + along * ways[0]), V(starts[1] + along * ways[1]), least);
    if (lowest.is_inside && lowest.gap <= least) return along > 0 || lowest.gap > 0;
    const Real free = std::max(lowest.gap, lowest.is_inside ? Real{0} : lowest.room);
    along += std::max(free / way, Real{1} / Real{kWayTries});
  }
  return false;
}

#define DRAPE_LOWEST(V)                                                                      \
  template LowestPoint<V> LowestOnEdge(const Solid<V>&, const V&, const V&, ScalarOf<V>);    \
  template LowestPoint<V> NextOnEdge(const Solid<V>&, const V&, const V&, ScalarOf<V>);      \
  template bool Meets(const Solid<V>&, const V&, const V&, V&, V&);                          \
  template bool MeetsEdge(const Solid<V>&, const std::array<V, 2>&, const std::array<V, 2>&, \
                          ScalarOf<V>, LowestPoint<V>&)
DRAPE_LOWEST(self_contact::Vector3f);
DRAPE_LOWEST(self_contact::Vector3d);
#undef DRAPE_LOWEST

}  // namespace drape::surface_contact
