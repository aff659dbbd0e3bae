// What a translated kernel (translate.py) needs of GLSL. Only translated kernels include it.
#pragma once

#include <bit>
#include <cmath>
#include <type_traits>

#include "kernel_interface.h"

using namespace drape::emulator;  // NOLINT(google-build-using-namespace): a kernel's own unit
using uint = uint32_t;
#define GLSL __attribute__((always_inline)) inline

static Machine* machine;
static const Arithmetic* arithmetic;
static uint emulated_local_size;
#define LOCAL_SIZE emulated_local_size

// The calls that led to a barrier.
__attribute__((noinline)) static uint64_t CallStack() {
  uint64_t hash = 0;
  void** frame = static_cast<void**>(__builtin_frame_address(0));
  while (frame != nullptr && frame < machine->first_frame) {
    hash = (hash ^ reinterpret_cast<uint64_t>(frame[1])) * 0x9e3779b97f4a7c15u;
    frame = static_cast<void**>(*frame);
  }
  return hash;
}

static float OffByUnits(float exact, uint operands) {
  const uint bits = std::bit_cast<uint>(exact);
  const bool is_normal = (bits & 0x7f800000u) != 0 && (bits & 0x7f800000u) != 0x7f800000u;
  // Constants are computed before there is any.
  if (arithmetic == nullptr || !arithmetic->is_inexact || !is_normal) return exact;
  uint hash = (operands ^ arithmetic->seed) * 2654435769u;
  hash = (hash ^ hash >> 15) * 2246822519u;
  return std::bit_cast<float>(bits + (hash >> 30) - 1u);
}

struct Float {
  float v;
  Float() = default;
  GLSL constexpr Float(float x) : v(x) {}
  GLSL explicit constexpr Float(double x) : v(float(x)) {}
  GLSL explicit constexpr Float(int x) : v(float(x)) {}
  GLSL explicit constexpr Float(uint x) : v(float(x)) {}
  GLSL explicit operator int() const { return int(v); }
  GLSL explicit operator uint() const { return v < 0 ? uint(int(v)) : uint(v); }
  GLSL explicit operator double() const { return v; }
};
GLSL constexpr Float operator""_f(long double x) {
  return Float(float(x));
}
GLSL constexpr Float operator+(Float a, Float b) {
  return a.v + b.v;
}
GLSL constexpr Float operator-(Float a, Float b) {
  return a.v - b.v;
}
GLSL constexpr Float operator*(Float a, Float b) {
  return a.v * b.v;
}
GLSL Float operator/(Float a, Float b) {
  return OffByUnits(a.v / b.v, std::bit_cast<uint>(a.v) * 31u + std::bit_cast<uint>(b.v));
}
GLSL constexpr Float operator-(Float a) {
  return -a.v;
}
GLSL Float& operator+=(Float& a, Float b) {
  return a = a + b;
}
GLSL Float& operator-=(Float& a, Float b) {
  return a = a - b;
}
GLSL Float& operator*=(Float& a, Float b) {
  return a = a * b;
}
GLSL Float& operator/=(Float& a, Float b) {
  return a = a / b;
}
GLSL bool operator<(Float a, Float b) {
  return a.v < b.v;
}
GLSL bool operator>(Float a, Float b) {
  return a.v > b.v;
}
GLSL bool operator<=(Float a, Float b) {
  return a.v <= b.v;
}
GLSL bool operator>=(Float a, Float b) {
  return a.v >= b.v;
}
GLSL bool operator==(Float a, Float b) {
  return a.v == b.v;
}
GLSL bool operator!=(Float a, Float b) {
  return a.v != b.v;
}

GLSL Float sqrt(Float x) {
  return OffByUnits(std::sqrt(x.v), std::bit_cast<uint>(x.v) ^ 0x5bd1e995u);
}
GLSL Float inversesqrt(Float x) {
  return OffByUnits(1.0f / std::sqrt(x.v), std::bit_cast<uint>(x.v) ^ 0x27d4eb2fu);
}
GLSL Float abs(Float x) {
  return std::fabs(x.v);
}
GLSL Float floor(Float x) {
  return std::floor(x.v);
}
GLSL Float sign(Float x) {
  return Float(float((x.v > 0) - (x.v < 0)));
}
GLSL Float fma(Float a, Float b, Float c) {
  return std::fma(a.v, b.v, c.v);
}
GLSL Float min(Float a, Float b) {
  return std::fmin(a.v, b.v);
}
GLSL Float max(Float a, Float b) {
  return std::fmax(a.v, b.v);
}
GLSL uint min(uint a, uint b) {
  return b < a ? b : a;
}
GLSL uint max(uint a, uint b) {
  return a < b ? b : a;
}
GLSL int min(int a, int b) {
  return b < a ? b : a;
}
GLSL int max(int a, int b) {
  return a < b ? b : a;
}
GLSL Float clamp(Float x, Float low, Float high) {
  return min(max(x, low), high);
}
GLSL uint clamp(uint x, uint low, uint high) {
  return min(max(x, low), high);
}
GLSL int clamp(int x, int low, int high) {
  return min(max(x, low), high);
}
GLSL Float mix(Float a, Float b, Float t) {
  return a * (Float(1.0f) - t) + b * t;
}
GLSL int findLSB(uint x) {
  return x == 0 ? -1 : std::countr_zero(x);
}
GLSL int bitCount(uint x) {
  return std::popcount(x);
}
GLSL uint bitfieldReverse(uint x) {
  uint reversed = 0;
  for (int bit = 0; bit < 32; ++bit) reversed |= (x >> bit & 1u) << (31 - bit);
  return reversed;
}
GLSL uint floatBitsToUint(Float x) {
  return std::bit_cast<uint>(x.v);
}
GLSL Float uintBitsToFloat(uint x) {
  return std::bit_cast<float>(x);
}
GLSL uint ToBits(Float x) {
  return std::bit_cast<uint>(x.v);
}
GLSL uint ToBits(uint x) {
  return x;
}
GLSL uint ToBits(int x) {
  return uint(x);
}

// An array of an invocation, or of a record in memory.
template <typename T, uint N>
struct Array {
  T elements[N];
  GLSL T& operator[](uint k) { return elements[Checked(k)]; }
  GLSL const T& operator[](uint k) const { return elements[Checked(k)]; }
  GLSL static uint Checked(uint k) {
    if (k < N) return k;
    machine->ReportIndex(k, N);
    return 0;
  }
  template <typename U>
  GLSL operator Array<U, N>() const {
    Array<U, N> copy;
    for (uint k = 0; k < N; ++k) copy.elements[k] = elements[k];
    return copy;
  }
  template <typename U>
  GLSL Array& operator=(const Array<U, N>& other) {
    for (uint k = 0; k < N; ++k) elements[k] = other.elements[k];
    return *this;
  }
};

// A word of a storage block or of shared memory.
template <typename T>
struct Word {
  uint bits;
  Word() = default;
  Word(const Word& other) = delete;
  GLSL operator T() const { return std::bit_cast<T>(machine->Read(&bits)); }
  GLSL explicit operator uint() const requires std::is_same_v<T, Float> { return uint(T(*this)); }
  GLSL explicit operator int() const requires std::is_same_v<T, Float> { return int(T(*this)); }
  GLSL Word& operator=(T value) {
    machine->Write(&bits, ToBits(value));
    return *this;
  }
  GLSL Word& operator=(const Word& other) { return *this = T(other); }
  GLSL Word& operator+=(T value) { return *this = T(*this) + value; }
  GLSL Word& operator-=(T value) { return *this = T(*this) - value; }
};

// A storage block, or a shared variable.
template <typename T>
struct Block : AnyBlock {
  GLSL T& operator[](uint k) {
    if (k < count) return reinterpret_cast<T*>(bytes)[k];
    machine->ReportIndex(k, count);
    static T nothing;
    return nothing;
  }
  template <typename U, uint N>
  GLSL operator Array<U, N>() {
    Array<U, N> copy;
    for (uint k = 0; k < N; ++k) copy.elements[k] = (*this)[k];
    return copy;
  }
};

#include "glsl_vectors.h"

GLSL uint atomicOr(Word<uint>& w, uint v) {
  return machine->Change(&w.bits, AtomicKind::kOr, v);
}
GLSL uint atomicAnd(Word<uint>& w, uint v) {
  return machine->Change(&w.bits, AtomicKind::kAnd, v);
}
GLSL uint atomicAdd(Word<uint>& w, uint v) {
  return machine->Change(&w.bits, AtomicKind::kAdd, v);
}
GLSL uint atomicMax(Word<uint>& w, uint v) {
  return machine->Change(&w.bits, AtomicKind::kMax, v);
}
GLSL uint atomicMin(Word<uint>& w, uint v) {
  return machine->Change(&w.bits, AtomicKind::kMin, v);
}
GLSL void barrier() {
  machine->Barrier(BarrierKind::kGroup, CallStack());
}
GLSL void memoryBarrierShared() {
  machine->MemoryBarrier(MemoryKind::kShared);
}
GLSL void memoryBarrierBuffer() {
  machine->MemoryBarrier(MemoryKind::kStorage);
}
GLSL void subgroupBarrier() {
  machine->Barrier(BarrierKind::kSubgroup, CallStack());
}
GLSL void subgroupMemoryBarrierShared() {}  // subgroupBarrier orders memory too
template <typename T>
GLSL T subgroupShuffle(T value, uint lane) {
  machine->Shuffle(reinterpret_cast<uint*>(&value), sizeof(T) / sizeof(uint), lane, CallStack());
  return value;
}
GLSL uvec4 subgroupBallot(bool flag) {
  uint flags = 0;
  for (uint lane = 0; lane < kSubgroupSize; ++lane) {
    flags |= subgroupShuffle(uint(flag), lane) << lane;
  }
  return {flags, 0, 0, 0};
}

struct Invocation {
  uvec3 gl_LocalInvocationID, gl_WorkGroupID, gl_NumWorkGroups, gl_GlobalInvocationID;
  explicit Invocation(const Ids& ids)
      : gl_LocalInvocationID(ids.local, 0, 0),
        gl_WorkGroupID(ids.group[0], ids.group[1], ids.group[2]),
        gl_NumWorkGroups(ids.group_count[0], ids.group_count[1], ids.group_count[2]),
        gl_GlobalInvocationID(ids.group[0] * ids.local_size + ids.local, ids.group[1],
                              ids.group[2]) {}
};
#define gl_SubgroupSize kSubgroupSize
#define gl_NumSubgroups ((LOCAL_SIZE + kSubgroupSize - 1) / kSubgroupSize)
#define gl_SubgroupID (gl_LocalInvocationID.x / kSubgroupSize)
#define gl_SubgroupInvocationID (gl_LocalInvocationID.x % kSubgroupSize)

void RunInvocation(const Ids& ids);
void Describe(std::vector<BlockInfo>& blocks, std::vector<BlockInfo>& shared,
              std::vector<UniformInfo>& uniforms);

static void SetUp(Machine* its_machine, const Arithmetic* its_arithmetic, uint local_size) {
  machine = its_machine;
  arithmetic = its_arithmetic;
  emulated_local_size = local_size;
}
static void Run(const Ids& ids) {
  machine->first_frame = __builtin_frame_address(0);
  RunInvocation(ids);
}
extern "C" __attribute__((visibility("default")))
const KernelEntry drape_emulated_kernel = {SetUp, Describe, Run};
