// Four floats side by side. Used in two ways: as the x, y, z of one particle (lane 3 stays 0), and
// as one number of each of four constraints that share no particle. Plain GCC and Clang vector
// types: every lane is rounded as a scalar float would be, so results do not depend on how lanes
// are filled.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>

namespace drape::cpu {

inline constexpr uint32_t kVec4Size = 4;

using Vec4 = float __attribute__((vector_size(16)));
// -1 in a lane where a comparison holds, else 0.
using Mask4 = int32_t __attribute__((vector_size(16)));

inline Vec4 ToVec4(const Eigen::Vector3d& v) {
  return Vec4{static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()), 0};
}
inline Eigen::Vector3d ToVector3d(const Vec4& v) {
  return {v[0], v[1], v[2]};
}
inline std::array<float, 3> Components(const Vec4& v) {
  return {v[0], v[1], v[2]};
}
inline Vec4 Splat(float value) {
  return Vec4{value, value, value, value};
}

// The value in all lanes, of the type of the second argument.
inline Vec4 SplatLike(float value, const Vec4&) {
  return Splat(value);
}

inline float SplatLike(float value, float) {
  return value;
}
// The vector x, y, z, of the type of the last argument.
inline Vec4 VectorLike(float x, float y, float z, const Vec4&) {
  return Vec4{x, y, z, 0};
}

// Over x, y, z; the sum is taken in that order.
inline float Dot(Vec4 a, Vec4 b) {
  const Vec4 product = a * b;
  return (product[0] + product[1]) + product[2];
}
inline float Length(Vec4 v) {
  return std::sqrt(Dot(v, v));
}

inline float Sqrt(float value) {
  return std::sqrt(value);
}
inline Vec4 Sqrt(Vec4 v) {
  return Vec4{std::sqrt(v[0]), std::sqrt(v[1]), std::sqrt(v[2]), std::sqrt(v[3])};
}
inline float Abs(float value) {
  return std::fabs(value);
}
inline Vec4 Abs(Vec4 v) {
  return v < 0 ? -v : v;
}

// A number that is none as b is the result, as one of the vector instructions.
inline float Min(float a, float b) {
  return a < b ? a : b;
}
inline Vec4 Min(Vec4 a, Vec4 b) {
  return a < b ? a : b;
}

inline float Max(float a, float b) {
  return a > b ? a : b;
}
inline Vec4 Max(Vec4 a, Vec4 b) {
  return a > b ? a : b;
}

// Lane by lane: a where the mask is set, else b.
inline Vec4 Select(Mask4 mask, Vec4 a, Vec4 b) {
  return mask ? a : b;
}

inline float Select(bool mask, float a, float b) {
  return mask ? a : b;
}
inline Vec4 Select(bool mask, const Vec4& a, const Vec4& b) {
  return mask ? a : b;
}

inline bool IsAnyLaneSet(bool mask) {
  return mask;
}
inline bool IsAnyLaneSet(Mask4 mask) {
  using Halves = int64_t __attribute__((vector_size(16)));
  const Halves halves = reinterpret_cast<Halves>(mask);
  return (halves[0] | halves[1]) != 0;
}

// The x, y and z of four vectors, one vector per lane.
struct Vectors4 {
  Vec4 x, y, z;
};
inline Vec4 Dot(const Vectors4& a, const Vectors4& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
inline Vectors4 operator+(const Vectors4& a, const Vectors4& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vectors4 operator-(const Vectors4& a, const Vectors4& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vectors4 operator*(Vec4 s, const Vectors4& v) {
  return {s * v.x, s * v.y, s * v.z};
}

inline Vectors4 Transpose(Vec4 a, Vec4 b, Vec4 c, Vec4 d) {
  const Vec4 ab_xy = __builtin_shuffle(a, b, Mask4{0, 4, 1, 5});
  const Vec4 cd_xy = __builtin_shuffle(c, d, Mask4{0, 4, 1, 5});
  const Vec4 ab_z = __builtin_shuffle(a, b, Mask4{2, 6, 3, 7});
  const Vec4 cd_z = __builtin_shuffle(c, d, Mask4{2, 6, 3, 7});
  return {__builtin_shuffle(ab_xy, cd_xy, Mask4{0, 1, 4, 5}),
          __builtin_shuffle(ab_xy, cd_xy, Mask4{2, 3, 6, 7}),
          __builtin_shuffle(ab_z, cd_z, Mask4{0, 1, 4, 5})};
}

inline Vectors4 Gather(const Vec4* vectors, const std::array<uint32_t, kVec4Size>& indices) {
  return Transpose(vectors[indices[0]], vectors[indices[1]], vectors[indices[2]],
                   vectors[indices[3]]);
}

// The four vectors again; lane 3 of each is 0.
inline std::array<Vec4, kVec4Size> Transpose(const Vectors4& v) {
  const Vec4 zero{};
  const Vec4 xy_low = __builtin_shuffle(v.x, v.y, Mask4{0, 4, 1, 5});
  const Vec4 xy_high = __builtin_shuffle(v.x, v.y, Mask4{2, 6, 3, 7});
  const Vec4 z_low = __builtin_shuffle(v.z, zero, Mask4{0, 4, 1, 5});
  const Vec4 z_high = __builtin_shuffle(v.z, zero, Mask4{2, 6, 3, 7});
  return {__builtin_shuffle(xy_low, z_low, Mask4{0, 1, 4, 5}),
          __builtin_shuffle(xy_low, z_low, Mask4{2, 3, 6, 7}),
          __builtin_shuffle(xy_high, z_high, Mask4{0, 1, 4, 5}),
          __builtin_shuffle(xy_high, z_high, Mask4{2, 3, 6, 7})};
}

}  // namespace drape::cpu
