// Where triangles are lowest above solids.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "server/solver/surface_contact/lowest_point.h"
#include "server/solver/surface_contact/triangle_weights.h"

namespace drape::surface_contact {
namespace {

using self_contact::Cross;
using self_contact::Dot;
using self_contact::Length;

constexpr int kTriangleTries = 16;
// What is flatter than this above a distance map is level [-].
constexpr float kLevelDip = 1e-3f;

// The nearest weights, nearly, of which none is negative.
template <class Real>
std::array<Real, 3> WithoutNegatives(std::array<Real, 3> weights) {
  Real sum = 0;
  for (Real& weight : weights) sum += weight = std::max(weight, Real{0});
  for (Real& weight : weights) weight /= sum;
  return weights;
}

template <class V>
V PointOf(const std::array<V, 3>& corners, const std::array<ScalarOf<V>, 3>& weights) {
  return corners[0] + weights[1] * (corners[1] - corners[0]) +
         weights[2] * (corners[2] - corners[0]);
}

// The shortest mean of two slopes: what is left of them on the ridge between.
template <class V>
V ShortestMean(const V& a, const V& b) {
  using Real = ScalarOf<V>;
  const V d = a - b;
  const Real length_sq = Dot(d, d);
  if (!(length_sq > 0)) return a;
  const Real share = std::clamp(Dot(a, d) / length_sq, Real{0}, Real{1});
  return a - share * d;
}

// Down the slope as long as that leads lower; where it does not there is a ridge, along which the
// mean of the slopes on both sides leads (a bundle of two: Lemarechal 1975).
template <class V>
LowestPoint<V> LowestOnTriangleAboveMap(const Solid<V>& solid, const std::array<V, 3>& corners,
                                        const V& normal, ScalarOf<V> least) {
  using Real = ScalarOf<V>;
  const V centre = PointOf<V>(corners, {Real{1} / 3, Real{1} / 3, Real{1} / 3});
  Real lowest_corner = std::numeric_limits<Real>::max(), radius = 0;
  for (const V& corner : corners) {
    lowest_corner = std::min(lowest_corner, solid.At(corner).gap);
    radius = std::max(radius, Length(V(corner - centre)));
  }
  Gap<V> at = solid.At(centre);
  const Real bound = at.gap - radius;
  if (bound > 0) return {.gap = bound};
  V best = centre;
  Gap<V> best_at = at;
  const auto slope_of = [&](const Gap<V>& gap) {
    return V(gap.normal - Dot(gap.normal, normal) * normal);
  };
  V slope = slope_of(at);
  Real step = radius / 2;
  bool is_at_rim = false;
  for (int k = 0; k < kTriangleTries; ++k) {
    const Real steepness = Length(slope);
    if (!(steepness > kLevelDip)) break;
    const V next = best - (step / steepness) * slope;
    is_at_rim = !AreInside(WeightsAt(corners, next), kLeastWeight);
    if (is_at_rim) {
      step /= 3;
      continue;
    }
    at = solid.At(next);
    if (at.gap < best_at.gap) {
      best = next;
      best_at = at;
      slope = slope_of(at);
    } else {
      if (step <= solid.cell()) slope = ShortestMean(slope, slope_of(at));
      step /= 2;
    }
  }
  const auto weights = WeightsAt(corners, best);
  if (is_at_rim || lowest_corner - best_at.gap <= least) return {.gap = bound};
  const V across = Dot(best_at.normal, normal) < 0 ? V(-normal) : normal;
  return {.is_inside = true, .weights = weights, .normal = across, .gap = best_at.gap};
}

// By how much the plane of a triangle turns at most for each length that its corners move, over
// its least height: about its longest side by 2, across it by less [-].
constexpr int kTurn = 3;

// How far corners may move before the foot of the lowest point of a round solid, which is `offset`
// beyond an end of its axis, may be inside the triangle; 0: it is. What is outside one of its sides
// stays so: the side goes with its nearer end, by 1, as the weights do that count; it turns by
// 2/length, which a foot beyond its ends feels by as much as it is beyond; and the plane turns, by
// a right angle's third at most, which the end of the axis feels by its distance from it, and what
// is outside by less than by itself.
template <class V>
ScalarOf<V> RoomOfFoot(const std::array<V, 3>& corners, ScalarOf<V> least_height,
                       const LowestPoint<V>& lowest, ScalarOf<V> offset) {
  using Real = ScalarOf<V>;
  if (lowest.is_inside) return 0;
  const V foot = PointOf(corners, lowest.weights);
  const Real distance = std::abs(lowest.gap + offset);
  Real room = 0;
  for (size_t k = 0; k < 3; ++k) {
    const V& begin = corners[(k + 1) % 3];
    const V d = corners[(k + 2) % 3] - begin;
    const Real length = Length(d), height = Length(Cross(V(corners[k] - begin), d)) / length;
    const Real outside = (static_cast<Real>(kLeastWeight) - lowest.weights[k]) * height;
    if (!(outside > 0)) continue;
    const Real along = Dot(V(foot - begin), d) / length;
    const Real from_end = std::min(std::abs(along), std::abs(length - along));
    room = std::max(
        room, outside / (2 + (kTurn * distance + outside) / least_height + 2 * from_end / length));
  }
  return std::min(room, least_height / (2 * kTurn));
}

// Whether the triangle is where the solid ends on the other side: its plane cuts the solid, but
// beside the triangle, and thin solids are soon behind it. There the nearest face is that of the
// other side, and much nearer.
template <class V>
bool IsOnOtherSide(const Solid<V>& solid, const std::array<V, 3>& corners,
                   const LowestPoint<V>& lowest) {
  if (!(lowest.gap < 0)) return false;
  const Gap<V> at = solid.At(PointOf(corners, WithoutNegatives(lowest.weights)));
  return at.gap > lowest.gap / 2 && Dot(at.normal, lowest.normal) < 0;
}

}  // namespace

// The normal is that of the triangle, on one side or the other, and the point that of the solid
// that is farthest along it: the support (Gilbert, Johnson & Keerthi 1988).
template <class V>
LowestPoint<V> LowestOnTriangle(const Solid<V>& solid, const std::array<V, 3>& corners,
                                ScalarOf<V> least) {
  using Real = ScalarOf<V>;
  const V cross = Cross(V(corners[1] - corners[0]), V(corners[2] - corners[0]));
  const Real twice_area = Length(cross);
  if (!(twice_area > 0)) return {};
  const V normal = cross / twice_area;
  if (!solid.is_convex()) return LowestOnTriangleAboveMap(solid, corners, normal, least);
  LowestPoint<V> none;
  none.room = solid.RoomAboveFace(corners);
  if (none.room > 0) return none;
  const bool is_round = solid.kind() == ShapeKind::kSphere || solid.kind() == ShapeKind::kCapsule;
  const auto from_side = [&](const V& n) -> LowestPoint<V> {
    const V farthest = solid.Farthest(n);
    const auto weights = WeightsAt(corners, farthest);
    return {.is_inside = AreInside(weights, is_round ? kLeastWeight : -kOverlap),
            .weights = weights,
            .normal = n,
            .gap = Dot(n, V(corners[0] - farthest)) - solid.offset()};
  };
  LowestPoint<V> lowest = from_side(normal), other = from_side(-normal);
  if (other.gap > lowest.gap) std::swap(lowest, other);
  if (lowest.is_inside && IsOnOtherSide(solid, corners, lowest)) lowest = other;
  if (is_round && !lowest.is_inside) {
    Real longest = 0;
    for (size_t k = 0; k < 3; ++k) {
      longest = std::max(longest, Length(V(corners[(k + 1) % 3] - corners[k])));
    }
    const Real height = twice_area / longest;
    lowest.room = std::min(RoomOfFoot(corners, height, lowest, solid.offset()),
                           RoomOfFoot(corners, height, other, solid.offset()));
    const Real length = Length(solid.segment());
    if (solid.kind() == ShapeKind::kCapsule && length > 0) {
      // Where the axis is level the farthest end becomes the other one.
      const Real tilt = std::abs(Dot(solid.segment(), normal)) / length;
      const Real until_level = std::max(tilt - static_cast<Real>(kLevelSlope), Real{0});
      lowest.room = std::min(lowest.room, until_level * height / kTurn);
    }
  }
  lowest.weights = WithoutNegatives(lowest.weights);
  return lowest;
}

template <class V>
LowestPoint<V> LowestCornerUnder(const Solid<V>& solid, const std::array<V, 3>& corners,
                                 const V& normal, std::vector<V>& corners_of_solid) {
  corners_of_solid.clear();
  solid.AddNearlyFarthest(normal, corners_of_solid);
  const double least_weight = solid.kind() == ShapeKind::kCapsule ? kLeastWeight : -kOverlap;
  LowestPoint<V> lowest;
  for (const V& corner : corners_of_solid) {
    const auto weights = WeightsAt(corners, corner);
    if (!AreInside(weights, least_weight)) continue;
    const auto gap = Dot(normal, V(corners[0] - corner)) - solid.offset();
    if (lowest.is_inside && gap >= lowest.gap) continue;
    lowest = {
        .is_inside = true, .weights = WithoutNegatives(weights), .normal = normal, .gap = gap};
  }
  return lowest;
}

#define DRAPE_LOWEST(V)                                                                            \
  template LowestPoint<V> LowestOnTriangle(const Solid<V>&, const std::array<V, 3>&, ScalarOf<V>); \
  template LowestPoint<V> LowestCornerUnder(const Solid<V>&, const std::array<V, 3>&, const V&,    \
                                            std::vector<V>&)
DRAPE_LOWEST(self_contact::Vector3f);
DRAPE_LOWEST(self_contact::Vector3d);
#undef DRAPE_LOWEST

}  // namespace drape::surface_contact
