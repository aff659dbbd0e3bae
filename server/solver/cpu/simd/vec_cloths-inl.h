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

#include <array>
#include <bit>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// At most 16 floats, also where the registers are longer.
using ClothsTag = hn::CappedTag<float, 16>;
inline constexpr uint32_t kClothCount = hn::MaxLanes(ClothsTag());

// Operators are no friends inside the classes: those would not be compiled for the instruction set.
struct MaskCloths {
  hn::Mask<ClothsTag> m{};
};
inline MaskCloths operator&(MaskCloths a, MaskCloths b) {
  return {hn::And(a.m, b.m)};
}
inline MaskCloths operator|(MaskCloths a, MaskCloths b) {
  return {hn::Or(a.m, b.m)};
}
// Set in the lanes in which b is set and a is not.
inline MaskCloths AndNot(MaskCloths a, MaskCloths b) {
  return {hn::AndNot(a.m, b.m)};
}
inline MaskCloths& operator|=(MaskCloths& a, MaskCloths b) {
  return a = a | b;
}
inline MaskCloths& operator&=(MaskCloths& a, MaskCloths b) {
  return a = a & b;
}
inline bool IsAnyLaneSet(MaskCloths mask) {
  return !hn::AllFalse(ClothsTag(), mask.m);
}
inline bool AreAllLanesSet(MaskCloths mask) {
  return hn::AllTrue(ClothsTag(), mask.m);
}
// A bit of each cloth, the first one lowest.
inline uint32_t BitsOf(MaskCloths mask) {
  uint8_t bytes[8] = {};
  hn::StoreMaskBits(ClothsTag(), mask.m, bytes);
  return bytes[0] | uint32_t{bytes[1]} << 8;
}
inline MaskCloths MaskOf(uint32_t bits) {
  static_assert(std::endian::native == std::endian::little);
  const uint64_t bytes = bits;  // eight: what Highway may read
  return {hn::LoadMaskBits(ClothsTag(), reinterpret_cast<const uint8_t*>(&bytes))};
}

struct VecCloths {
  hn::Vec<ClothsTag> v;
};
inline VecCloths SplatCloths(float value) {
  return {hn::Set(ClothsTag(), value)};
}
inline VecCloths SplatLike(float value, VecCloths) {
  return SplatCloths(value);
}
// `values`: [kClothCount], aligned like a vector register.
inline VecCloths LoadCloths(const float* values) {
  return {hn::Load(ClothsTag(), values)};
}

inline VecCloths operator+(VecCloths a, VecCloths b) {
  return {hn::Add(a.v, b.v)};
}
inline VecCloths operator-(VecCloths a, VecCloths b) {
  return {hn::Sub(a.v, b.v)};
}
inline VecCloths operator*(VecCloths a, VecCloths b) {
  return {hn::Mul(a.v, b.v)};
}
inline VecCloths operator/(VecCloths a, VecCloths b) {
  return {hn::Div(a.v, b.v)};
}
inline VecCloths operator*(VecCloths a, float b) {
  return a * SplatCloths(b);
}
inline VecCloths operator/(VecCloths a, float b) {
  return a / SplatCloths(b);
}
inline VecCloths operator-(VecCloths a) {
  return {hn::Neg(a.v)};
}
inline MaskCloths operator<(VecCloths a, VecCloths b) {
  return {hn::Lt(a.v, b.v)};
}
inline MaskCloths operator>(VecCloths a, VecCloths b) {
  return {hn::Gt(a.v, b.v)};
}
inline MaskCloths operator>=(VecCloths a, VecCloths b) {
  return {hn::Ge(a.v, b.v)};
}
inline MaskCloths operator!=(VecCloths a, VecCloths b) {
  return {hn::Ne(a.v, b.v)};
}

inline VecCloths Sqrt(VecCloths a) {
  return {hn::Sqrt(a.v)};
}
inline VecCloths Abs(VecCloths a) {
  return {hn::Abs(a.v)};
}
// Lane by lane: a where the mask is set, else b.
inline VecCloths Select(MaskCloths mask, VecCloths a, VecCloths b) {
  return {hn::IfThenElse(mask.m, a.v, b.v)};
}
inline VecCloths Min(VecCloths a, VecCloths b) {
  return {hn::Min(a.v, b.v)};
}
inline VecCloths Max(VecCloths a, VecCloths b) {
  return {hn::Max(a.v, b.v)};
}

// One number of each of two strips of each cloth: two chains of dependent operations side by side,
// so that one fills the time that the other waits for a division.
struct MaskPair {
  MaskCloths low, high;
};
inline MaskPair& operator|=(MaskPair& a, const MaskPair& b) {
  a = {a.low | b.low, a.high | b.high};
  return a;
}
inline bool IsAnyLaneSet(const MaskPair& mask) {
  return IsAnyLaneSet(mask.low | mask.high);
}

struct VecPair {
  VecCloths low, high;
};
inline VecPair SplatLike(float value, const VecPair&) {
  return {SplatCloths(value), SplatCloths(value)};
}
inline VecPair operator+(const VecPair& a, const VecPair& b) {
  return {a.low + b.low, a.high + b.high};
}
inline VecPair operator-(const VecPair& a, const VecPair& b) {
  return {a.low - b.low, a.high - b.high};
}
inline VecPair operator*(const VecPair& a, const VecPair& b) {
  return {a.low * b.low, a.high * b.high};
}
inline VecPair operator/(const VecPair& a, const VecPair& b) {
  return {a.low / b.low, a.high / b.high};
}
inline VecPair operator*(const VecPair& a, float b) {
  return {a.low * b, a.high * b};
}
inline VecPair operator-(const VecPair& a) {
  return {-a.low, -a.high};
}
inline MaskPair operator<(const VecPair& a, const VecPair& b) {
  return {a.low < b.low, a.high < b.high};
}
inline MaskPair operator>(const VecPair& a, const VecPair& b) {
  return {a.low > b.low, a.high > b.high};
}
inline VecPair Sqrt(const VecPair& a) {
  return {Sqrt(a.low), Sqrt(a.high)};
}
inline VecPair Abs(const VecPair& a) {
  return {Abs(a.low), Abs(a.high)};
}
inline VecPair Select(const MaskPair& mask, const VecPair& a, const VecPair& b) {
  return {Select(mask.low, a.low, b.low), Select(mask.high, a.high, b.high)};
}
inline VecPair Max(const VecPair& a, const VecPair& b) {
  return {Max(a.low, b.low), Max(a.high, b.high)};
}

// The x, y and z of one vector of each lane.
template <class Scalars>
struct VectorsOf {
  Scalars x, y, z;
};
using VectorsCloths = VectorsOf<VecCloths>;
using VectorsPair = VectorsOf<VecPair>;

template <class Scalars>
VectorsOf<Scalars> operator+(const VectorsOf<Scalars>& a, const VectorsOf<Scalars>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class Scalars>
VectorsOf<Scalars> operator-(const VectorsOf<Scalars>& a, const VectorsOf<Scalars>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class Scalars>
VectorsOf<Scalars> operator-(const VectorsOf<Scalars>& a) {
  return {-a.x, -a.y, -a.z};
}
template <class Scalars>
VectorsOf<Scalars> operator*(const Scalars& s, const VectorsOf<Scalars>& v) {
  return {s * v.x, s * v.y, s * v.z};
}
template <class Scalars>
HWY_INLINE Scalars Dot(const VectorsOf<Scalars>& a, const VectorsOf<Scalars>& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
inline VectorsCloths operator*(const VectorsCloths& v, float s) {
  return SplatCloths(s) * v;
}
inline VectorsCloths operator/(const VectorsCloths& v, float s) {
  return {v.x / s, v.y / s, v.z / s};
}
inline VectorsCloths operator/(const VectorsCloths& v, VecCloths s) {
  return {v.x / s, v.y / s, v.z / s};
}
inline VectorsCloths Select(MaskCloths mask, const VectorsCloths& a, const VectorsCloths& b) {
  return {Select(mask, a.x, b.x), Select(mask, a.y, b.y), Select(mask, a.z, b.z)};
}
inline std::array<VecCloths, 3> Components(const VectorsCloths& v) {
  return {v.x, v.y, v.z};
}
inline VectorsCloths VectorLike(float x, float y, float z, const VectorsCloths&) {
  return {SplatCloths(x), SplatCloths(y), SplatCloths(z)};
}
// target = value; one by one, as GCC copies the whole through the stack.
template <class Scalars>
HWY_INLINE void Assign(VectorsOf<Scalars>& target, const VectorsOf<Scalars>& value) {
  target.x = value.x;
  target.y = value.y;
  target.z = value.z;
}
inline VectorsPair Join(const VectorsCloths& low, const VectorsCloths& high) {
  return {{low.x, high.x}, {low.y, high.y}, {low.z, high.z}};
}
inline VectorsCloths Low(const VectorsPair& pair) {
  return {pair.x.low, pair.y.low, pair.z.low};
}
inline VectorsCloths High(const VectorsPair& pair) {
  return {pair.x.high, pair.y.high, pair.z.high};
}

}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
