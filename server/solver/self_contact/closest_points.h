// The nearest points of a vertex and a triangle, and of two edges. Pure.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "server/solver/self_contact/vectors.h"

namespace drape::self_contact {

// Of two primitives that have four corners together. `difference` is the sum of weights times
// corners, from the nearest point of the second primitive to that of the first one; the weights of
// the first add up to 1, those of the second to -1.
template <class V>
struct ClosestPoints {
  std::array<ScalarOf<V>, 4> weights{};
  V difference{};
};

template <class Real>
inline Real Clamped(Real value) {
  return std::min(std::max(value, Real{0}), Real{1});
}

// Of edges p0 p1 and p2 p3 (Ericson 2005, «Real-Time Collision Detection», section 5.1.9).
template <class V>
inline ClosestPoints<V> ClosestOfEdges(const std::array<V, 4>& p) {
  using Real = ScalarOf<V>;
  constexpr Real kTiny = std::numeric_limits<Real>::min();
  const V d1 = p[1] - p[0], d2 = p[3] - p[2], r = p[0] - p[2];
  const Real a = Dot(d1, d1) + kTiny, e = Dot(d2, d2) + kTiny;
  const Real b = Dot(d1, d2), c = Dot(d1, r), f = Dot(d2, r);
  const Real denominator = a * e - b * b;
  // Nearly parallel edges: any point of the first is as good, up to the ends.
  constexpr Real kParallel = 16 * std::numeric_limits<Real>::epsilon();
  const bool is_parallel = !(denominator > kParallel * a * e);
  Real s = is_parallel ? Real{0.5} : Clamped((b * f - c * e) / denominator);
  const Real t = Clamped((b * s + f) / e);
  s = Clamped((b * t - c) / a);
  return {{1 - s, s, t - 1, -t}, (r + s * d1) - t * d2};
}

// Of vertex p0 and triangle p1 p2 p3 (Ericson 2005, section 5.1.5).
template <class V>
inline ClosestPoints<V> ClosestOfVertex(const std::array<V, 4>& p) {
  using Real = ScalarOf<V>;
  const V ab = p[2] - p[1], ac = p[3] - p[1], ap = p[0] - p[1];
  const auto at = [&](Real v, Real w) {
    return ClosestPoints<V>{{1, v + w - 1, -v, -w}, (ap - v * ab) - w * ac};
  };
  const Real d1 = Dot(ab, ap), d2 = Dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return at(0, 0);
  const V bp = p[0] - p[2];
  const Real d3 = Dot(ab, bp), d4 = Dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return at(1, 0);
  const Real vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return at(d1 / (d1 - d3), 0);
  const V cp = p[0] - p[3];
  const Real d5 = Dot(ab, cp), d6 = Dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return at(0, 1);
  const Real vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return at(0, d2 / (d2 - d6));
  const Real va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const Real w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return at(1 - w, w);
  }
  const Real total = va + vb + vc;
  return total > 0 ? at(vb / total, vc / total) : at(0, 0);
}

// The kinds of pairs, and how many of their four corners the first primitive has.
enum class PairKind : uint8_t { kVertexTriangle, kEdges };
constexpr int FirstCorners(PairKind kind) {
  return kind == PairKind::kVertexTriangle ? 1 : 2;
}

template <class V>
inline ClosestPoints<V> Closest(PairKind kind, const std::array<V, 4>& p) {
  return kind == PairKind::kVertexTriangle ? ClosestOfVertex(p) : ClosestOfEdges(p);
}

// How far the first primitive is from the second along n: from its lowest corner to the highest one
// of the other, negative where they overlap. Differences of corners keep their digits far from the
// origin.
template <class V>
inline ScalarOf<V> GapAlong(PairKind kind, const std::array<V, 4>& p, const V& n) {
  using Real = ScalarOf<V>;
  const Real x1 = Dot(n, V(p[1] - p[0])), x2 = Dot(n, V(p[2] - p[0])), x3 = Dot(n, V(p[3] - p[0]));
  if (kind == PairKind::kVertexTriangle) return -std::max(std::max(x1, x2), x3);
  return std::min(Real{0}, x1) - std::max(x2, x3);
}

}  // namespace drape::self_contact
