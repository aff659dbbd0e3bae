// Four vectors side by side: what is the same for many points takes a quarter of the operations,
// each rounded as that of one vector. Formulas for one point or four are templates of their Vector:
// V itself, or FourVectors<V>.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>

#include "server/solver/self_contact/vectors.h"

namespace drape::surface_contact {

using self_contact::ScalarOf;

inline constexpr size_t kFour = 4;  // numbers in a vector

// A vector of each of four. V is a number of each of them.
template <class V>
struct FourVectors {
  V x, y, z;

  FourVectors operator+(const FourVectors& other) const {
    return {x + other.x, y + other.y, z + other.z};
  }
  FourVectors operator-(const FourVectors& other) const {
    return {x - other.x, y - other.y, z - other.z};
  }
  FourVectors operator-() const { return {-x, -y, -z}; }
  FourVectors operator*(const V& factor) const { return {x * factor, y * factor, z * factor}; }
  FourVectors operator/(const V& divisor) const { return {x / divisor, y / divisor, z / divisor}; }
};

// Of a Vector: the vector of one point, a number of each point, and what a comparison of these is.
template <class Vector>
struct PointsOf {
  using Base = Vector;
  using Number = ScalarOf<Vector>;
};
template <class V>
struct PointsOf<FourVectors<V>> {
  using Base = V;
  using Number = V;
};
template <class Vector>
using BaseOf = typename PointsOf<Vector>::Base;
template <class Vector>
using NumberOf = typename PointsOf<Vector>::Number;
template <class Number>
using MaskOfNumber = std::decay_t<decltype(Number{} < Number{})>;
template <class Vector>
using MaskOf = MaskOfNumber<NumberOf<Vector>>;

// The same number, or the same vector, of each point.
template <class Number, class Real>
Number OfAll(Real value) {
  if constexpr (std::is_arithmetic_v<Number>) {
    return static_cast<Number>(value);
  } else {
    const auto its = static_cast<ScalarOf<Number>>(value);
    return Number{its, its, its, its};
  }
}
template <class Vector>
Vector Same(const BaseOf<Vector>& v) {
  if constexpr (std::is_same_v<Vector, BaseOf<Vector>>) {
    return v;
  } else {
    using V = BaseOf<Vector>;
    return {OfAll<V>(v[0]), OfAll<V>(v[1]), OfAll<V>(v[2])};
  }
}

template <class V>
FourVectors<V> SideBySide(const std::array<V, kFour>& v) {
  const V xy_01 = __builtin_shufflevector(v[0], v[1], 0, 4, 1, 5);
  const V xy_23 = __builtin_shufflevector(v[2], v[3], 0, 4, 1, 5);
  const V z_01 = __builtin_shufflevector(v[0], v[1], 2, 6, 3, 7);
  const V z_23 = __builtin_shufflevector(v[2], v[3], 2, 6, 3, 7);
  return {__builtin_shufflevector(xy_01, xy_23, 0, 1, 4, 5),
          __builtin_shufflevector(xy_01, xy_23, 2, 3, 6, 7),
          __builtin_shufflevector(z_01, z_23, 0, 1, 4, 5)};
}

using self_contact::Cross;
using self_contact::Dot;
using self_contact::Length;

template <class V>
V Dot(const FourVectors<V>& a, const FourVectors<V>& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
template <class V>
V Roots(const V& v) {
  return V{std::sqrt(v[0]), std::sqrt(v[1]), std::sqrt(v[2]), std::sqrt(v[3])};
}
#ifdef __SSE2__
template <>
inline self_contact::Vector3f Roots(const self_contact::Vector3f& v) {
  return __builtin_ia32_sqrtps(v);  // GCC takes them one by one
}
#endif
template <class V>
V Length(const FourVectors<V>& v) {
  return Roots(V(Dot(v, v)));
}
template <class V>
FourVectors<V> Cross(const FourVectors<V>& a, const FourVectors<V>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class T>
T Select(bool mask, const T& a, const T& b) {
  return mask ? a : b;
}
template <class V>
FourVectors<V> Select(const MaskOf<FourVectors<V>>& mask, const FourVectors<V>& a,
                      const FourVectors<V>& b) {
  return {mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
}
using self_contact::IsAnySet;
inline bool IsAnySet(bool mask) {
  return mask;
}
inline bool AreAllSet(bool mask) {
  return mask;
}
template <class Mask>
bool AreAllSet(const Mask& mask) {
  return self_contact::BitsOf(mask) == 0xF;
}
// As std::clamp, which is of one number.
template <class Number>
Number ClampedBetween(const Number& number, const Number& low, const Number& high) {
  return number < low ? low : Number(high < number ? high : number);
}

// Each of the four.
template <class V>
std::array<V, kFour> Apart(const FourVectors<V>& v) {
  const V zero{};
  const V xy_01 = __builtin_shufflevector(v.x, v.y, 0, 4, 1, 5);
  const V xy_23 = __builtin_shufflevector(v.x, v.y, 2, 6, 3, 7);
  const V z_01 = __builtin_shufflevector(v.z, zero, 0, 4, 1, 5);
  const V z_23 = __builtin_shufflevector(v.z, zero, 2, 6, 3, 7);
  return {__builtin_shufflevector(xy_01, z_01, 0, 1, 4, 5),
          __builtin_shufflevector(xy_01, z_01, 2, 3, 6, 7),
          __builtin_shufflevector(xy_23, z_23, 0, 1, 4, 5),
          __builtin_shufflevector(xy_23, z_23, 2, 3, 6, 7)};
}

}  // namespace drape::surface_contact
