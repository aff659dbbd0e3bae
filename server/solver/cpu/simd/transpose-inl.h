// Vectors of one place each into the lanes, and back. Compiled once per instruction set.
#if defined(DRAPE_CPU_SIMD_TRANSPOSE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIMD_TRANSPOSE_INL_H_
#undef DRAPE_CPU_SIMD_TRANSPOSE_INL_H_
#else
#define DRAPE_CPU_SIMD_TRANSPOSE_INL_H_
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <span>

#include "server/solver/cpu/simd/vec4.h"
#include "server/solver/cpu/simd/vec_cloths-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

#if HWY_TARGET == HWY_SCALAR

// One lane.
VectorsCloths LoadVectors(const Vec4* const (&vectors)[kClothCount], size_t index) {
  const Vec4& vector = vectors[0][index];
  return {SplatCloths(vector[0]), SplatCloths(vector[1]), SplatCloths(vector[2])};
}
void StoreVectors(const VectorsCloths& vectors, std::span<Vec4* const> results, size_t index) {
  results[0][index] =
      Vec4{hn::GetLane(vectors.x.v), hn::GetLane(vectors.y.v), hn::GetLane(vectors.z.v), 0};
}

#else

// A register consists of blocks of four lanes. To turn x, y, z, 0 of each lane into x, y and z of
// all, four registers are transposed block by block: block b of register r has lane 4 b + r.
inline constexpr uint32_t kBlockSize = 4;

// One block of each of `vectors[0]`, `vectors[4]`, ...
template <class Tag>
HWY_INLINE hn::Vec<Tag> LoadBlocks(Tag tag, const Vec4* const* vectors, size_t index) {
  if constexpr (hn::MaxLanes(tag) == kBlockSize) {
    return hn::Load(tag, reinterpret_cast<const float*>(*vectors + index));
  } else {
    const hn::Half<Tag> half;
    return hn::Combine(tag, LoadBlocks(half, vectors + hn::MaxLanes(half), index),
                       LoadBlocks(half, vectors, index));
  }
}
// The same back; lanes from `end` on have no place.
template <class Tag>
HWY_INLINE void StoreBlocks(Tag tag, hn::Vec<Tag> blocks, Vec4* const* results, Vec4* const* end,
                            size_t index) {
  if constexpr (hn::MaxLanes(tag) == kBlockSize) {
    if (results < end) hn::Store(blocks, tag, reinterpret_cast<float*>(*results + index));
  } else {
    const hn::Half<Tag> half;
    StoreBlocks(half, hn::LowerHalf(half, blocks), results, end, index);
    StoreBlocks(half, hn::UpperHalf(half, blocks), results + hn::MaxLanes(half), end, index);
  }
}

// Pairs of floats of each block: the lower ones of both, the upper ones of both.
using FloatVec = hn::Vec<ClothsTag>;
using PairTag = hn::RepartitionToWide<ClothsTag>;
HWY_INLINE FloatVec LowerPairs(FloatVec a, FloatVec b) {
  const PairTag pairs;
  return hn::BitCast(ClothsTag(),
                     hn::InterleaveLower(pairs, hn::BitCast(pairs, a), hn::BitCast(pairs, b)));
}
HWY_INLINE FloatVec UpperPairs(FloatVec a, FloatVec b) {
  const PairTag pairs;
  return hn::BitCast(ClothsTag(),
                     hn::InterleaveUpper(pairs, hn::BitCast(pairs, a), hn::BitCast(pairs, b)));
}

// The vector at `index` of each lane's array.
HWY_INLINE VectorsCloths LoadVectors(const Vec4* const (&vectors)[kClothCount], size_t index) {
  const ClothsTag tag;
  const FloatVec a = LoadBlocks(tag, vectors, index), b = LoadBlocks(tag, vectors + 1, index),
                 c = LoadBlocks(tag, vectors + 2, index), d = LoadBlocks(tag, vectors + 3, index);
  const FloatVec ab_xy = hn::InterleaveLower(tag, a, b), cd_xy = hn::InterleaveLower(tag, c, d);
  const FloatVec ab_z = hn::InterleaveUpper(tag, a, b), cd_z = hn::InterleaveUpper(tag, c, d);
  return {{LowerPairs(ab_xy, cd_xy)}, {UpperPairs(ab_xy, cd_xy)}, {LowerPairs(ab_z, cd_z)}};
}

// The vector of each lane to its place `index` of its results, as many as there are.
HWY_INLINE void StoreVectors(const VectorsCloths& vectors, std::span<Vec4* const> results,
                             size_t index) {
  const ClothsTag tag;
  const FloatVec zero = hn::Zero(tag);
  const FloatVec ab_xy = hn::InterleaveLower(tag, vectors.x.v, vectors.y.v),
                 cd_xy = hn::InterleaveUpper(tag, vectors.x.v, vectors.y.v),
                 ab_z = hn::InterleaveLower(tag, vectors.z.v, zero),
                 cd_z = hn::InterleaveUpper(tag, vectors.z.v, zero);
  Vec4* const* const first = results.data();
  Vec4* const* const end = first + results.size();
  StoreBlocks(tag, LowerPairs(ab_xy, ab_z), first, end, index);
  StoreBlocks(tag, UpperPairs(ab_xy, ab_z), first + 1, end, index);
  StoreBlocks(tag, LowerPairs(cd_xy, cd_z), first + 2, end, index);
  StoreBlocks(tag, UpperPairs(cd_xy, cd_z), first + 3, end, index);
}

#endif

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
