// Eight floats as two times four: two chains of dependent operations side by side, so that one
// fills the time that the other waits for a division. Each lane is rounded like a scalar float.
#pragma once

#include <array>
#include <cstdint>

#include "server/solver/cpu/lanes.h"

namespace drape::cpu {

inline constexpr uint32_t kWideCount = 2 * kLaneCount;

struct WideLanes {
  Lanes low, high;

  float Get(uint32_t lane) const { return lane < kLaneCount ? low[lane] : high[lane - kLaneCount]; }
  void Set(uint32_t lane, float value) {
    (lane < kLaneCount ? low[lane] : high[lane - kLaneCount]) = value;
  }

  friend WideLanes operator+(const WideLanes& a, const WideLanes& b) {
    return {a.low + b.low, a.high + b.high};
  }
  friend WideLanes operator-(const WideLanes& a, const WideLanes& b) {
    return {a.low - b.low, a.high - b.high};
  }
  friend WideLanes operator*(const WideLanes& a, const WideLanes& b) {
    return {a.low * b.low, a.high * b.high};
  }
  friend WideLanes operator*(const WideLanes& a, float b) { return {a.low * b, a.high * b}; }
  friend WideLanes operator/(const WideLanes& a, const WideLanes& b) {
    return {a.low / b.low, a.high / b.high};
  }
  friend WideLanes operator/(float a, const WideLanes& b) { return {a / b.low, a / b.high}; }
  friend WideLanes operator-(const WideLanes& a) { return {-a.low, -a.high}; }
};

struct WideMask {
  LaneMask low, high;

  WideMask& operator|=(const WideMask& other) {
    low |= other.low;
    high |= other.high;
    return *this;
  }
};

inline WideMask operator>(const WideLanes& a, const WideLanes& b) {
  return {a.low > b.low, a.high > b.high};
}
inline WideMask operator<(const WideLanes& a, const WideLanes& b) {
  return {a.low < b.low, a.high < b.high};
}
inline bool IsAnyLaneSet(const WideMask& mask) {
  return IsAnyLaneSet(mask.low | mask.high);
}

inline WideLanes WideSplat(float value) {
  return {Splat(value), Splat(value)};
}
inline WideLanes AllLanes(float value, const WideLanes&) {
  return WideSplat(value);
}
inline WideLanes Sqrt(const WideLanes& v) {
  return {Sqrt(v.low), Sqrt(v.high)};
}
inline WideLanes Abs(const WideLanes& v) {
  return {Abs(v.low), Abs(v.high)};
}
// Lane by lane: a where the mask is set, else b.
inline WideLanes Select(const WideMask& mask, const WideLanes& a, const WideLanes& b) {
  return {mask.low ? a.low : b.low, mask.high ? a.high : b.high};
}
inline WideLanes Max(const WideLanes& a, const WideLanes& b) {
  return Select(a > b, a, b);
}

// The x, y and z of eight vectors.
struct WideVectors {
  WideLanes x, y, z;
};
inline WideLanes Dot(const WideVectors& a, const WideVectors& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
inline WideVectors operator+(const WideVectors& a, const WideVectors& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline WideVectors operator-(const WideVectors& a, const WideVectors& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline WideVectors operator*(const WideLanes& s, const WideVectors& v) {
  return {s * v.x, s * v.y, s * v.z};
}

inline WideVectors Transpose(const std::array<Lanes, kWideCount>& v) {
  const LaneVectors low = Transpose(v[0], v[1], v[2], v[3]);
  const LaneVectors high = Transpose(v[4], v[5], v[6], v[7]);
  return {{low.x, high.x}, {low.y, high.y}, {low.z, high.z}};
}

}  // namespace drape::cpu
