// Three numbers side by side, single or double precision, for code that is the same for both.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <limits>

namespace drape::self_contact {

// x, y, z and a fourth number, which is 0. Each is rounded as a scalar would be.
using Vector3f = float __attribute__((vector_size(16)));
using Vector3d = double __attribute__((vector_size(32)));

template <class V>
struct ScalarOfVector;
template <>
struct ScalarOfVector<Vector3f> {
  using Type = float;
};
template <>
struct ScalarOfVector<Vector3d> {
  using Type = double;
};
template <class V>
using ScalarOf = typename ScalarOfVector<V>::Type;

template <class V>
V ToVector(const Eigen::Vector3d& v) {
  using Real = ScalarOf<V>;
  return V{static_cast<Real>(v.x()), static_cast<Real>(v.y()), static_cast<Real>(v.z()), 0};
}
template <class V>
Eigen::Vector3d FromVector(const V& v) {
  return {v[0], v[1], v[2]};
}

template <class V>
inline ScalarOf<V> Dot(const V& a, const V& b) {
  const V product = a * b;
  return (product[0] + product[1]) + product[2];
}
template <class V>
inline ScalarOf<V> SquaredLength(const V& v) {
  return Dot(v, v);
}
template <class V>
inline ScalarOf<V> Length(const V& v) {
  return std::sqrt(Dot(v, v));
}
template <class V>
inline V Cross(const V& a, const V& b) {
  return V{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0};
}
template <class V>
inline V Min(const V& a, const V& b) {
  return a < b ? a : b;
}
template <class V>
inline V Max(const V& a, const V& b) {
  return a > b ? a : b;
}
template <class V>
inline V Abs(const V& v) {
  return v < 0 ? -v : v;
}
template <class V>
inline V Splat(ScalarOf<V> value) {
  return V{value, value, value, 0};
}
template <class V>
inline ScalarOf<V> LargestOf(const V& v) {
  const ScalarOf<V> xy = v[0] > v[1] ? v[0] : v[1];
  return xy > v[2] ? xy : v[2];
}

// A box; empty at first.
template <class V>
struct Box {
  V low = Splat<V>(std::numeric_limits<ScalarOf<V>>::max());
  V high = Splat<V>(-std::numeric_limits<ScalarOf<V>>::max());

  void Add(const V& point) {
    low = Min(low, point);
    high = Max(high, point);
  }
  void Add(const Box& box) {
    low = Min(low, box.low);
    high = Max(high, box.high);
  }
};

// What a comparison of two vectors gives.
using Mask3f = int32_t __attribute__((vector_size(16)));
using Mask3d = int64_t __attribute__((vector_size(32)));
// Bit k: number k of the mask.
inline uint32_t BitsOf(const Mask3f& mask) {
#ifdef __SSE2__
  return static_cast<uint32_t>(__builtin_ia32_movmskps(reinterpret_cast<Vector3f>(mask)));
#else
  uint32_t bits = 0;
  for (uint32_t k = 0; k < 4; ++k) bits |= static_cast<uint32_t>(mask[k] & 1) << k;
  return bits;
#endif
}
inline uint32_t BitsOf(const Mask3d& mask) {
  uint32_t bits = 0;
  for (uint32_t k = 0; k < 4; ++k) bits |= static_cast<uint32_t>(mask[k] & 1) << k;
  return bits;
}

template <class Mask>
inline bool IsAnySet(const Mask& mask) {
  return BitsOf(mask) != 0;
}

// Whether the boxes are no farther apart than `margin` along each axis.
template <class V>
inline bool AreNear(const Box<V>& a, const Box<V>& b, const V& margin) {
  return !IsAnySet((a.low - b.high > margin) | (b.low - a.high > margin));
}

}  // namespace drape::self_contact
