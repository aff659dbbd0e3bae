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

inline constexpr uint32_t kLaneCount = 4;

using Lanes = float __attribute__((vector_size(16)));
// -1 in a lane where a comparison holds, else 0.
using LaneMask = int32_t __attribute__((vector_size(16)));

inline Lanes ToLanes(const Eigen::Vector3d& v) {
  return Lanes{static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()), 0};
}
inline Eigen::Vector3d ToVector3d(const Lanes& v) {
  return {v[0], v[1], v[2]};
}
inline Lanes Splat(float value) {
  return Lanes{value, value, value, value};
}

// The value in all lanes, of the type of the second argument.
inline Lanes AllLanes(float value, const Lanes&) {
  return Splat(value);
}

// Of x, y, z; the sum is taken in that order.
inline float Dot(Lanes a, Lanes b) {
  const Lanes product = a * b;
  return (product[0] + product[1]) + product[2];
}
inline float Length(Lanes v) {
  return std::sqrt(Dot(v, v));
}

inline float Sqrt(float value) {
  return std::sqrt(value);
}
inline Lanes Sqrt(Lanes v) {
  return Lanes{std::sqrt(v[0]), std::sqrt(v[1]), std::sqrt(v[2]), std::sqrt(v[3])};
}
inline float Abs(float value) {
  return std::fabs(value);
}
inline Lanes Abs(Lanes v) {
  return v < 0 ? -v : v;
}

inline Lanes Min(Lanes a, Lanes b) {
  return a < b ? a : b;
}

inline Lanes Max(Lanes a, Lanes b) {
  return a > b ? a : b;
}

// Lane by lane: a where the mask is set, else b.
inline Lanes Select(LaneMask mask, Lanes a, Lanes b) {
  return mask ? a : b;
}

inline bool IsAnyLaneSet(LaneMask mask) {
  using Halves = int64_t __attribute__((vector_size(16)));
  const Halves halves = reinterpret_cast<Halves>(mask);
  return (halves[0] | halves[1]) != 0;
}

// The x, y and z of four vectors, one vector per lane.
struct LaneVectors {
  Lanes x, y, z;
};
inline Lanes Dot(const LaneVectors& a, const LaneVectors& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
inline LaneVectors operator+(const LaneVectors& a, const LaneVectors& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline LaneVectors operator*(Lanes s, const LaneVectors& v) {
  return {s * v.x, s * v.y, s * v.z};
}

inline LaneVectors Transpose(Lanes a, Lanes b, Lanes c, Lanes d) {
  const Lanes ab_xy = __builtin_shuffle(a, b, LaneMask{0, 4, 1, 5});
  const Lanes cd_xy = __builtin_shuffle(c, d, LaneMask{0, 4, 1, 5});
  const Lanes ab_z = __builtin_shuffle(a, b, LaneMask{2, 6, 3, 7});
  const Lanes cd_z = __builtin_shuffle(c, d, LaneMask{2, 6, 3, 7});
  return {__builtin_shuffle(ab_xy, cd_xy, LaneMask{0, 1, 4, 5}),
          __builtin_shuffle(ab_xy, cd_xy, LaneMask{2, 3, 6, 7}),
          __builtin_shuffle(ab_z, cd_z, LaneMask{0, 1, 4, 5})};
}

inline LaneVectors Gather(const Lanes* vectors, const std::array<uint32_t, kLaneCount>& indices) {
  return Transpose(vectors[indices[0]], vectors[indices[1]], vectors[indices[2]],
                   vectors[indices[3]]);
}

inline LaneVectors Minus(const LaneVectors& a, const LaneVectors& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

// The four vectors again; lane 3 of each is 0.
inline std::array<Lanes, kLaneCount> Transpose(const LaneVectors& v) {
  const Lanes zero{};
  const Lanes xy_low = __builtin_shuffle(v.x, v.y, LaneMask{0, 4, 1, 5});
  const Lanes xy_high = __builtin_shuffle(v.x, v.y, LaneMask{2, 6, 3, 7});
  const Lanes z_low = __builtin_shuffle(v.z, zero, LaneMask{0, 4, 1, 5});
  const Lanes z_high = __builtin_shuffle(v.z, zero, LaneMask{2, 6, 3, 7});
  return {__builtin_shuffle(xy_low, z_low, LaneMask{0, 1, 4, 5}),
          __builtin_shuffle(xy_low, z_low, LaneMask{2, 3, 6, 7}),
          __builtin_shuffle(xy_high, z_high, LaneMask{0, 1, 4, 5}),
          __builtin_shuffle(xy_high, z_high, LaneMask{2, 3, 6, 7})};
}

}  // namespace drape::cpu
