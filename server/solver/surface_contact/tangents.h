// Where an edge dips between its ends, by tangents of the distance from what is sharp: of one edge
// or of four at once, Vector as in four_vectors.h.
#pragma once

#include <limits>

#include "server/solver/self_contact/closest_points.h"
#include "server/solver/surface_contact/four_vectors.h"
#include "server/solver/surface_contact/lowest_point.h"
#include "server/solver/surface_contact/solid.h"

namespace drape::surface_contact {

// Places that an edge is tried at, beside its ends, at most. More: a little nearer; fewer: the gap
// of what is far from a round solid is less exact.
inline constexpr int kMostTries = 10;
// The gap is found to this share of the least dip that counts [-].
inline constexpr double kExactness = 0.25;
// Where the mean of two normals across an edge is shorter than this [-] the edge goes through a
// plate from one face to the other: no way across it is out.
inline constexpr double kLeastMean = 0.1;

// What is known of the distance along an edge, at a place on it.
template <class Vector>
struct Tangent {
  NumberOf<Vector> place{};  // 0 to 1
  Gap<Vector> at{};
  NumberOf<Vector> slope{};  // along the whole edge [m]
};

// at(point): the gap there; of the edge from a to a + d.
template <class Vector, class At>
Tangent<Vector> TangentAt(const At& at, const Vector& a, const Vector& d,
                          const NumberOf<Vector>& place) {
  const Gap<Vector> gap = at(Vector(a + d * place));
  return {place, gap, Dot(gap.normal, d)};
}

template <class V>
Tangent<FourVectors<V>> Select(const MaskOf<FourVectors<V>>& mask, const Tangent<FourVectors<V>>& a,
                               const Tangent<FourVectors<V>>& b) {
  return {mask ? a.place : b.place,
          {mask ? a.at.gap : b.at.gap, Select(mask, a.at.normal, b.at.normal)},
          mask ? a.slope : b.slope};
}

// The half-spaces behind the tangents of two places hold the solid, and so does each mean of them.
// That mean across the edge has all of the edge at the same distance: where the tangents meet.
template <class Vector>
struct Wedge {
  using Number = NumberOf<Vector>;
  using Real = ScalarOf<BaseOf<Vector>>;

  // `offset`: around a core whose edges are sharp. `tilt`: the slope that the edge has along the
  // normal instead of none.
  Wedge(const Tangent<Vector>& low, const Tangent<Vector>& high, Real offset, const Number& tilt) {
    const Number difference = low.slope - high.slope;  // < 0
    place = ClampedBetween(
        Number((high.at.gap - low.at.gap + low.slope * low.place - high.slope * high.place) /
               difference),
        low.place, high.place);
    height = low.at.gap + low.slope * (place - low.place);
    const Number share = (tilt - high.slope) / difference;
    const Vector mean = low.at.normal * share + high.at.normal * Number(1 - share);
    const Number length = Length(mean);
    is_across = length > static_cast<Real>(kLeastMean);
    normal = mean / length;
    gap = is_across ? Number((height + offset) / length - offset)
                    : OfAll<Number>(std::numeric_limits<Real>::lowest());
  }

  Number place;
  Number height;  // of both tangents there [m]
  MaskOf<Vector> is_across;
  // Where it is across the edge: of the edge along the normal [m].
  Vector normal{};
  Number gap;
};

// Where edges are lowest that fall inwards at both ends, and whether that is a place inside; else
// the gap is a bound.
template <class Vector>
struct Dip {
  using Number = NumberOf<Vector>;
  using Mask = MaskOf<Vector>;

  Mask is_inside{};
  Number place{};
  Vector normal{};
  Number gap{};

  // Of those in the mask.
  void Set(const Mask& mask, const Mask& inside, const Number& its_place, const Vector& its_normal,
           const Number& its_gap) {
    is_inside |= mask & inside;
    place = mask ? its_place : place;
    normal = Select(mask, its_normal, normal);
    gap = mask ? its_gap : gap;
  }
};

// The distance is convex along the edge, and falls inwards at both ends, less a tilt: that is added
// to it from the first end to the other [m]. `is_left`: of these edges.
template <class Vector, class At>
Dip<Vector> DipByTangents(const At& at, ScalarOf<BaseOf<Vector>> offset, const Vector& a,
                          const Vector& d, Tangent<Vector> low, Tangent<Vector> high,
                          ScalarOf<BaseOf<Vector>> least, const NumberOf<Vector>& tilt,
                          MaskOf<Vector> is_left) {
  using Number = NumberOf<Vector>;
  using Mask = MaskOf<Vector>;
  using Real = ScalarOf<BaseOf<Vector>>;
  const Number no_dip = self_contact::Min(Number(low.at.gap - tilt * low.place),
                                          Number(high.at.gap - tilt * high.place)) -
                        least;
  const Real exactness = static_cast<Real>(kExactness) * least;
  Dip<Vector> dip;
  for (int k = 0;; ++k) {
    const Wedge<Vector> wedge(low, high, offset, tilt);
    const Mask is_above = is_left & (wedge.height - tilt * wedge.place > no_dip);
    dip.Set(is_above, Mask{}, wedge.place, wedge.normal, no_dip);
    is_left &= !is_above;
    if (!IsAnySet(is_left)) return dip;

    // Between round solids and far from edges the slope is nearly linear, at edges it jumps.
    const Number secant =
        low.place + (low.slope - tilt) / (low.slope - high.slope) * (high.place - low.place);
    const bool is_jump = k % 2 == 0;
    const Tangent<Vector> next = TangentAt(at, a, d, is_jump ? wedge.place : secant);

    const Mask is_level = is_left & (next.slope == tilt);
    dip.Set(is_level, is_level, next.place, next.at.normal, next.at.gap);
    is_left &= !is_level;

    const Mask is_exact = next.at.gap - self_contact::Max(wedge.height, wedge.gap) <= exactness;
    const Mask is_between = (low.place < next.place) & (next.place < high.place);
    const Mask is_over = is_left & (k == kMostTries ? Mask(!Mask{}) : Mask(is_exact | !is_between));
    dip.Set(is_over, wedge.is_across, wedge.place, wedge.normal,
            wedge.is_across ? wedge.gap : wedge.height);
    is_left &= !is_over;
    if (!IsAnySet(is_left)) return dip;

    const Mask is_low = next.slope < tilt;
    low = Select(is_low, next, low);
    high = Select(is_low, high, next);
  }
}

// Of a place on an edge that goes on beyond its ends by kOverlap: the nearest on the edge itself.
template <class Real>
Real PlaceOnShorter(Real place) {
  return self_contact::Clamped(place * static_cast<Real>(1 + 2 * kOverlap) -
                               static_cast<Real>(kOverlap));
}

}  // namespace drape::surface_contact
