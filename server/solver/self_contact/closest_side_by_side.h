// The nearest points of four pairs of one kind at a time: the functions of closest_points.h without
// branches, whose outcome no processor can foresee, and with the same bits.
#pragma once

#include <array>
#include <cstdint>

#include "server/solver/self_contact/closest_points.h"
#include "server/solver/self_contact/vectors.h"

namespace drape::self_contact {

inline constexpr size_t kPairsSideBySide = 4;  // numbers in a vector

// A point of each of four pairs: one coordinate after the other.
template <class V>
struct FourPoints {
  V x, y, z;
};
template <class V>
inline FourPoints<V> operator+(const FourPoints<V>& a, const FourPoints<V>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class V>
inline FourPoints<V> operator-(const FourPoints<V>& a, const FourPoints<V>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class V>
inline FourPoints<V> operator*(const V& factors, const FourPoints<V>& a) {
  return {factors * a.x, factors * a.y, factors * a.z};
}
template <class V>
inline FourPoints<V> operator/(const FourPoints<V>& a, const V& divisors) {
  return {a.x / divisors, a.y / divisors, a.z / divisors};
}
template <class V>
inline V Dot(const FourPoints<V>& a, const FourPoints<V>& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
template <class V>
inline V RootOf(const V& value) {
  return V{std::sqrt(value[0]), std::sqrt(value[1]), std::sqrt(value[2]), std::sqrt(value[3])};
}

// The particles of four pairs.
using FourPairs = std::array<const std::array<uint32_t, 4>*, kPairsSideBySide>;
// Their corners [corner].
template <class V>
using FourCorners = std::array<FourPoints<V>, 4>;

template <class V>
inline FourPoints<V> Transposed(const V& a, const V& b, const V& c, const V& d) {
  const V low = __builtin_shufflevector(a, b, 0, 4, 1, 5);
  const V other_low = __builtin_shufflevector(c, d, 0, 4, 1, 5);
  const V high = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const V other_high = __builtin_shufflevector(c, d, 2, 6, 3, 7);
  return {__builtin_shufflevector(low, other_low, 0, 1, 4, 5),
          __builtin_shufflevector(low, other_low, 2, 3, 6, 7),
          __builtin_shufflevector(high, other_high, 0, 1, 4, 5)};
}

template <class V>
inline FourCorners<V> CornersOf(const FourPairs& pairs, const V* positions) {
  FourCorners<V> corners;
  for (size_t k = 0; k < 4; ++k) {
    corners[k] = Transposed(positions[(*pairs[0])[k]], positions[(*pairs[1])[k]],
                            positions[(*pairs[2])[k]], positions[(*pairs[3])[k]]);
  }
  return corners;
}

// As std::max and std::min choose, of zeros too.
template <class V>
inline V Larger(const V& a, const V& b) {
  return a < b ? b : a;
}
template <class V>
inline V Smaller(const V& a, const V& b) {
  return b < a ? b : a;
}

template <class V>
struct FourClosestPoints {
  std::array<V, 4> weights;  // [corner]
  FourPoints<V> difference;
};

template <class V>
inline FourClosestPoints<V> ClosestOfEdges(const FourCorners<V>& p) {
  using Real = ScalarOf<V>;
  constexpr Real kTiny = std::numeric_limits<Real>::min();
  constexpr Real kParallel = 16 * std::numeric_limits<Real>::epsilon();
  const V zero{}, one = zero + 1, half = zero + Real{0.5};
  const auto clamped = [&](const V& value) { return Smaller(Larger(value, zero), one); };
  const auto d1 = p[1] - p[0], d2 = p[3] - p[2], r = p[0] - p[2];
  const V a = Dot(d1, d1) + kTiny, e = Dot(d2, d2) + kTiny;
  const V b = Dot(d1, d2), c = Dot(d1, r), f = Dot(d2, r);
  const V denominator = a * e - b * b;
  V s = denominator > kParallel * a * e ? clamped(V((b * f - c * e) / denominator)) : half;
  const V t = clamped(V((b * s + f) / e));
  s = clamped(V((b * t - c) / a));
  return {{1 - s, s, t - 1, -t}, (r + s * d1) - t * d2};
}

template <class V>
inline FourClosestPoints<V> ClosestOfVertex(const FourCorners<V>& p) {
  const V zero{}, one = zero + 1;
  const auto ab = p[2] - p[1], ac = p[3] - p[1], ap = p[0] - p[1];
  const auto bp = p[0] - p[2], cp = p[0] - p[3];
  const V d1 = Dot(ab, ap), d2 = Dot(ac, ap), d3 = Dot(ab, bp), d4 = Dot(ac, bp);
  const V d5 = Dot(ab, cp), d6 = Dot(ac, cp);
  const V va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  const V total = va + vb + vc;
  // What is tested first decides, so it is chosen last.
  V v = total > 0 ? V(vb / total) : zero, w = total > 0 ? V(vc / total) : zero;
  const auto choose = [&](const auto& where, const V& other_v, const V& other_w) {
    v = where ? other_v : v;
    w = where ? other_w : w;
  };
  const V across = (d4 - d3) / ((d4 - d3) + (d5 - d6));
  choose((va <= 0) & (d4 - d3 >= 0) & (d5 - d6 >= 0), V(1 - across), across);
  choose((vb <= 0) & (d2 >= 0) & (d6 <= 0), zero, V(d2 / (d2 - d6)));
  choose((d6 >= 0) & (d5 <= d6), zero, one);
  choose((vc <= 0) & (d1 >= 0) & (d3 <= 0), V(d1 / (d1 - d3)), zero);
  choose((d3 >= 0) & (d4 <= d3), one, zero);
  choose((d1 <= 0) & (d2 <= 0), zero, zero);
  return {{one, v + w - 1, -v, -w}, (ap - v * ab) - w * ac};
}

template <class V>
inline FourClosestPoints<V> Closest(PairKind kind, const FourCorners<V>& p) {
  return kind == PairKind::kVertexTriangle ? ClosestOfVertex(p) : ClosestOfEdges(p);
}

template <class V>
inline V GapAlong(PairKind kind, const FourCorners<V>& p, const FourPoints<V>& n) {
  const V x1 = Dot(n, p[1] - p[0]), x2 = Dot(n, p[2] - p[0]), x3 = Dot(n, p[3] - p[0]);
  if (kind == PairKind::kVertexTriangle) return -Larger(Larger(x1, x2), x3);
  return Smaller(V{}, x1) - Larger(x2, x3);
}

}  // namespace drape::self_contact
