// Four vectors side by side: what is the same for many points takes a quarter of the operations,
// each rounded as that of one vector.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

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
template <class V>
using MaskOfFour = decltype(V{} < V{});

template <class V>
V OfFour(ScalarOf<V> value) {
  return V{value, value, value, value};
}
// The same vector of all four.
template <class V>
FourVectors<V> Same(const V& v) {
  return {OfFour<V>(v[0]), OfFour<V>(v[1]), OfFour<V>(v[2])};
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
template <class V>
FourVectors<V> Select(const MaskOfFour<V>& mask, const FourVectors<V>& a, const FourVectors<V>& b) {
  return {mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
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
