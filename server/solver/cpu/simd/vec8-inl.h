// Eight floats: one vector register where the instruction set has such, else two of four lanes, two
// chains of dependent operations side by side, so that one fills the time that the other waits for
// a division. Each lane is rounded like a scalar float. Compiled once per instruction set.
#if defined(DRAPE_CPU_SIMD_VEC8_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIMD_VEC8_INL_H_
#undef DRAPE_CPU_SIMD_VEC8_INL_H_
#else
#define DRAPE_CPU_SIMD_VEC8_INL_H_
#endif

#include <hwy/highway.h>

#include <array>
#include <cstdint>
#include <cstring>

#include "server/solver/cpu/simd/numbers8.h"
#include "server/solver/cpu/simd/vec4.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {

// The part of them in one register.
#if HWY_MAX_BYTES >= 32
using Part = float __attribute__((vector_size(32)));
using PartMask = int32_t __attribute__((vector_size(32)));
#else
using Part = Vec4;
using PartMask = Mask4;
#endif
inline constexpr uint32_t kPartCount = kVec8Size * sizeof(float) / sizeof(Part);

inline Part RootOf(const Part& part) {
#if HWY_MAX_BYTES >= 32
  namespace hn = hwy::HWY_NAMESPACE;
  hn::Vec<hn::CappedTag<float, kVec8Size>> v;
  std::memcpy(&v, &part, sizeof(part));
  v = hn::Sqrt(v);
  Part root;
  std::memcpy(&root, &v, sizeof(root));
  return root;
#else
  return cpu::Sqrt(part);
#endif
}

// Operators are no friends inside the classes: those would not be compiled for the instruction set.
struct Vec8 {
  Part parts[kPartCount];
};
struct Mask8 {
  PartMask parts[kPartCount];
};

// f of each part.
template <class Result, class Function, class... Wide>
inline Result EachPart(const Function& f, const Wide&... wide) {
  if constexpr (kPartCount == 1) {
    return {{f(wide.parts[0]...)}};
  } else {
    return {{f(wide.parts[0]...), f(wide.parts[1]...)}};
  }
}

inline Vec8 operator+(const Vec8& a, const Vec8& b) {
  return EachPart<Vec8>([](const Part& x, const Part& y) { return x + y; }, a, b);
}
inline Vec8 operator-(const Vec8& a, const Vec8& b) {
  return EachPart<Vec8>([](const Part& x, const Part& y) { return x - y; }, a, b);
}
inline Vec8 operator*(const Vec8& a, const Vec8& b) {
  return EachPart<Vec8>([](const Part& x, const Part& y) { return x * y; }, a, b);
}
inline Vec8 operator/(const Vec8& a, const Vec8& b) {
  return EachPart<Vec8>([](const Part& x, const Part& y) { return x / y; }, a, b);
}
inline Vec8 operator*(const Vec8& a, float b) {
  return EachPart<Vec8>([b](const Part& x) { return x * b; }, a);
}
inline Vec8 operator-(const Vec8& a) {
  return EachPart<Vec8>([](const Part& x) { return -x; }, a);
}
inline Mask8 operator<(const Vec8& a, const Vec8& b) {
  return EachPart<Mask8>([](const Part& x, const Part& y) { return x < y; }, a, b);
}
inline Mask8 operator>(const Vec8& a, const Vec8& b) {
  return b < a;
}
inline Mask8& operator|=(Mask8& a, const Mask8& b) {
  return a = EachPart<Mask8>([](const PartMask& x, const PartMask& y) { return x | y; }, a, b);
}

inline Vec8 Splat8(float value) {
  return EachPart<Vec8>([value](const Part& zero) { return value - zero; }, Vec8{});
}
inline Vec8 SplatLike(float value, const Vec8&) {
  return Splat8(value);
}
// Lane by lane: a where the mask is set, else b.
inline Vec8 Select(const Mask8& mask, const Vec8& a, const Vec8& b) {
  return EachPart<Vec8>([](const PartMask& m, const Part& x, const Part& y) { return m ? x : y; },
                        mask, a, b);
}
inline Vec8 Max(const Vec8& a, const Vec8& b) {
  return Select(a > b, a, b);
}
inline Vec8 Sqrt(const Vec8& a) {
  return EachPart<Vec8>([](const Part& x) { return RootOf(x); }, a);
}
inline Vec8 Abs(const Vec8& a) {
  return Select(a < Vec8{}, -a, a);
}

inline bool IsAnyLaneSet(const Mask8& mask) {
#if HWY_MAX_BYTES >= 32
  const PartMask& m = mask.parts[0];
  return cpu::IsAnyLaneSet(__builtin_shufflevector(m, m, 0, 1, 2, 3) |
                           __builtin_shufflevector(m, m, 4, 5, 6, 7));
#else
  return cpu::IsAnyLaneSet(mask.parts[0] | mask.parts[1]);
#endif
}

inline Vec8 Load(const Numbers8& numbers) {
  Vec8 lanes;
  std::memcpy(&lanes, &numbers, sizeof(lanes));
  return lanes;
}

// Eight floats one after the other, aligned or not.
inline Vec8 LoadEight(const float* values) {
  Vec8 lanes;
  std::memcpy(&lanes, values, sizeof(lanes));
  return lanes;
}
inline void StoreEight(const Vec8& lanes, float* values) {
  std::memcpy(values, &lanes, sizeof(lanes));
}

inline Numbers8 Store(const Vec8& lanes) {
  Numbers8 numbers;
  std::memcpy(&numbers, &lanes, sizeof(numbers));
  return numbers;
}

// The x, y and z of eight vectors.
struct Vectors8 {
  Vec8 x, y, z;
};
inline Vec8 Dot(const Vectors8& a, const Vectors8& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
inline Vectors8 operator+(const Vectors8& a, const Vectors8& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vectors8 operator-(const Vectors8& a, const Vectors8& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vectors8 operator*(const Vec8& s, const Vectors8& v) {
  return {s * v.x, s * v.y, s * v.z};
}

inline Vec8 JoinVectors(const Vec4& low, const Vec4& high) {
#if HWY_MAX_BYTES >= 32
  return {{__builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7)}};
#else
  return {{low, high}};
#endif
}
inline std::array<Vec4, 2> SplitVectors(const Vec8& both) {
#if HWY_MAX_BYTES >= 32
  const Part& v = both.parts[0];
  return {__builtin_shufflevector(v, v, 0, 1, 2, 3), __builtin_shufflevector(v, v, 4, 5, 6, 7)};
#else
  return {both.parts[0], both.parts[1]};
#endif
}

// The named lanes: in each half, 0 to 3 are those of a, 4 to 7 those of b.
template <int k0, int k1, int k2, int k3>
inline Vec8 Pick(const Vec8& a, const Vec8& b) {
#if HWY_MAX_BYTES >= 32
  constexpr int kSkip = kVec4Size;  // the other four lanes of a
  constexpr int l0 = k0 < 4 ? k0 : k0 + kSkip, l1 = k1 < 4 ? k1 : k1 + kSkip,
                l2 = k2 < 4 ? k2 : k2 + kSkip, l3 = k3 < 4 ? k3 : k3 + kSkip;
  return {{__builtin_shufflevector(a.parts[0], b.parts[0], l0, l1, l2, l3, l0 + kSkip, l1 + kSkip,
                                   l2 + kSkip, l3 + kSkip)}};
#else
  return EachPart<Vec8>(
      [](const Part& x, const Part& y) { return __builtin_shufflevector(x, y, k0, k1, k2, k3); }, a,
      b);
#endif
}
inline Vec8 InterleaveLower(const Vec8& a, const Vec8& b) {
  return Pick<0, 4, 1, 5>(a, b);
}
inline Vec8 InterleaveUpper(const Vec8& a, const Vec8& b) {
  return Pick<2, 6, 3, 7>(a, b);
}
inline Vec8 JoinLower(const Vec8& a, const Vec8& b) {
  return Pick<0, 1, 4, 5>(a, b);
}
inline Vec8 JoinUpper(const Vec8& a, const Vec8& b) {
  return Pick<2, 3, 6, 7>(a, b);
}

// Eight vectors x, y, z, 0: pair k has vectors k and k + 4.
using VectorPairs = std::array<Vec8, kVec4Size>;

inline Vectors8 Transpose(const VectorPairs& v) {
  const Vec8 xy_of_01 = InterleaveLower(v[0], v[1]), xy_of_23 = InterleaveLower(v[2], v[3]);
  const Vec8 z_of_01 = InterleaveUpper(v[0], v[1]), z_of_23 = InterleaveUpper(v[2], v[3]);
  return {JoinLower(xy_of_01, xy_of_23), JoinUpper(xy_of_01, xy_of_23),
          JoinLower(z_of_01, z_of_23)};
}
inline VectorPairs Transpose(const Vectors8& v) {
  const Vec8 none{};
  const Vec8 xy_of_01 = InterleaveLower(v.x, v.y), xy_of_23 = InterleaveUpper(v.x, v.y);
  const Vec8 z_of_01 = InterleaveLower(v.z, none), z_of_23 = InterleaveUpper(v.z, none);
  return {JoinLower(xy_of_01, z_of_01), JoinUpper(xy_of_01, z_of_01), JoinLower(xy_of_23, z_of_23),
          JoinUpper(xy_of_23, z_of_23)};
}

}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
