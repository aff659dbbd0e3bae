// One number of each cloth of a group: a lane of a vector register per cloth, as many as the
// instruction set has. The operations of vec4.h, each rounded like a scalar float. Compiled once
// per instruction set.
#if defined(DRAPE_CPU_SIMD_VEC_CLOTHS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIMD_VEC_CLOTHS_INL_H_
#undef DRAPE_CPU_SIMD_VEC_CLOTHS_INL_H_
#else
#define DRAPE_CPU_SIMD_VEC_CLOTHS_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// At most 16 floats, also where the registers are longer.
using LaneTag = hn::CappedTag<float, 16>;
inline constexpr uint32_t kClothCount = hn::MaxLanes(LaneTag());

// Operators are no friends inside the classes: those would not be compiled for the instruction set.
struct ClothMask {
  hn::Mask<LaneTag> m{};
};
inline ClothMask operator&(ClothMask a, ClothMask b) {
  return {hn::And(a.m, b.m)};
}
inline ClothMask operator|(ClothMask a, ClothMask b) {
  return {hn::Or(a.m, b.m)};
}
// Where a is not set and b is.
inline ClothMask AndNot(ClothMask a, ClothMask b) {
  return {hn::AndNot(a.m, b.m)};
}
inline ClothMask& operator|=(ClothMask& a, ClothMask b) {
  return a = a | b;
}
inline ClothMask& operator&=(ClothMask& a, ClothMask b) {
  return a = a & b;
}
inline bool IsAnyLaneSet(ClothMask mask) {
  return !hn::AllFalse(LaneTag(), mask.m);
}
// A bit of each cloth, the first one lowest.
inline uint32_t BitsOf(ClothMask mask) {
  uint8_t bytes[8] = {};
  hn::StoreMaskBits(LaneTag(), mask.m, bytes);
  return bytes[0] | uint32_t{bytes[1]} << 8;
}
inline ClothMask MaskOf(uint32_t bits) {
  // Eight bytes: what Highway may read.
  const uint8_t bytes[8] = {static_cast<uint8_t>(bits), static_cast<uint8_t>(bits >> 8)};
  return {hn::LoadMaskBits(LaneTag(), bytes)};
}

struct ClothLanes {
  hn::Vec<LaneTag> v;
};
inline ClothLanes SplatCloths(float value) {
  return {hn::Set(LaneTag(), value)};
}
inline ClothLanes AllLanes(float value, ClothLanes) {
  return SplatCloths(value);
}
// `values`: [kClothCount], aligned like a vector register.
inline ClothLanes LoadCloths(const float* values) {
  return {hn::Load(LaneTag(), values)};
}

inline ClothLanes operator+(ClothLanes a, ClothLanes b) {
  return {hn::Add(a.v, b.v)};
}
inline ClothLanes operator-(ClothLanes a, ClothLanes b) {
  return {hn::Sub(a.v, b.v)};
}
inline ClothLanes operator*(ClothLanes a, ClothLanes b) {
  return {hn::Mul(a.v, b.v)};
}
inline ClothLanes operator/(ClothLanes a, ClothLanes b) {
  return {hn::Div(a.v, b.v)};
}
inline ClothLanes operator*(ClothLanes a, float b) {
  return a * SplatCloths(b);
}
inline ClothLanes operator/(ClothLanes a, float b) {
  return a / SplatCloths(b);
}
inline ClothLanes operator-(ClothLanes a) {
  return {hn::Neg(a.v)};
}
inline ClothMask operator<(ClothLanes a, ClothLanes b) {
  return {hn::Lt(a.v, b.v)};
}
inline ClothMask operator>(ClothLanes a, ClothLanes b) {
  return {hn::Gt(a.v, b.v)};
}
inline ClothMask operator>=(ClothLanes a, ClothLanes b) {
  return {hn::Ge(a.v, b.v)};
}
inline ClothMask operator!=(ClothLanes a, ClothLanes b) {
  return {hn::Ne(a.v, b.v)};
}

inline ClothLanes Sqrt(ClothLanes a) {
  return {hn::Sqrt(a.v)};
}
inline ClothLanes Abs(ClothLanes a) {
  return {hn::Abs(a.v)};
}
// Lane by lane: a where the mask is set, else b.
inline ClothLanes Select(ClothMask mask, ClothLanes a, ClothLanes b) {
  return {hn::IfThenElse(mask.m, a.v, b.v)};
}
inline ClothLanes Min(ClothLanes a, ClothLanes b) {
  return {hn::Min(a.v, b.v)};
}
inline ClothLanes Max(ClothLanes a, ClothLanes b) {
  return {hn::Max(a.v, b.v)};
}

// One number of each of two strips of each cloth: two chains of dependent operations side by side,
// so that one fills the time that the other waits for a division.
struct PairMask {
  ClothMask low, high;
};
inline PairMask& operator|=(PairMask& a, const PairMask& b) {
  a = {a.low | b.low, a.high | b.high};
  return a;
}
inline bool IsAnyLaneSet(const PairMask& mask) {
  return IsAnyLaneSet(mask.low | mask.high);
}

struct PairLanes {
  ClothLanes low, high;
};
inline PairLanes AllLanes(float value, const PairLanes&) {
  return {SplatCloths(value), SplatCloths(value)};
}
inline PairLanes operator+(const PairLanes& a, const PairLanes& b) {
  return {a.low + b.low, a.high + b.high};
}
inline PairLanes operator-(const PairLanes& a, const PairLanes& b) {
  return {a.low - b.low, a.high - b.high};
}
inline PairLanes operator*(const PairLanes& a, const PairLanes& b) {
  return {a.low * b.low, a.high * b.high};
}
inline PairLanes operator/(const PairLanes& a, const PairLanes& b) {
  return {a.low / b.low, a.high / b.high};
}
inline PairLanes operator*(const PairLanes& a, float b) {
  return {a.low * b, a.high * b};
}
inline PairLanes operator-(const PairLanes& a) {
  return {-a.low, -a.high};
}
inline PairMask operator<(const PairLanes& a, const PairLanes& b) {
  return {a.low < b.low, a.high < b.high};
}
inline PairMask operator>(const PairLanes& a, const PairLanes& b) {
  return {a.low > b.low, a.high > b.high};
}
inline PairLanes Sqrt(const PairLanes& a) {
  return {Sqrt(a.low), Sqrt(a.high)};
}
inline PairLanes Abs(const PairLanes& a) {
  return {Abs(a.low), Abs(a.high)};
}
inline PairLanes Select(const PairMask& mask, const PairLanes& a, const PairLanes& b) {
  return {Select(mask.low, a.low, b.low), Select(mask.high, a.high, b.high)};
}
inline PairLanes Max(const PairLanes& a, const PairLanes& b) {
  return {Max(a.low, b.low), Max(a.high, b.high)};
}

// The x, y and z of one vector of each lane.
template <class Scalars>
struct VectorsOf {
  Scalars x, y, z;
};
using ClothVectors = VectorsOf<ClothLanes>;
using PairVectors = VectorsOf<PairLanes>;

template <class Scalars>
VectorsOf<Scalars> operator+(const VectorsOf<Scalars>& a, const VectorsOf<Scalars>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class Scalars>
VectorsOf<Scalars> operator-(const VectorsOf<Scalars>& a, const VectorsOf<Scalars>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class Scalars>
VectorsOf<Scalars> operator*(const Scalars& s, const VectorsOf<Scalars>& v) {
  return {s * v.x, s * v.y, s * v.z};
}
template <class Scalars>
Scalars Dot(const VectorsOf<Scalars>& a, const VectorsOf<Scalars>& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
inline ClothVectors operator*(const ClothVectors& v, float s) {
  return SplatCloths(s) * v;
}
inline ClothVectors operator/(const ClothVectors& v, float s) {
  return {v.x / s, v.y / s, v.z / s};
}
inline ClothVectors operator/(const ClothVectors& v, ClothLanes s) {
  return {v.x / s, v.y / s, v.z / s};
}
inline ClothVectors Select(ClothMask mask, const ClothVectors& a, const ClothVectors& b) {
  return {Select(mask, a.x, b.x), Select(mask, a.y, b.y), Select(mask, a.z, b.z)};
}
// target = value; one by one, as GCC copies the whole through the stack.
template <class Scalars>
void Assign(VectorsOf<Scalars>& target, const VectorsOf<Scalars>& value) {
  target.x = value.x;
  target.y = value.y;
  target.z = value.z;
}
inline PairVectors Join(const ClothVectors& low, const ClothVectors& high) {
  return {{low.x, high.x}, {low.y, high.y}, {low.z, high.z}};
}
inline ClothVectors Low(const PairVectors& pair) {
  return {pair.x.low, pair.y.low, pair.z.low};
}
inline ClothVectors High(const PairVectors& pair) {
  return {pair.x.high, pair.y.high, pair.z.high};
}

}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
