#include "server/solver/cpu/alone/grid_elastic.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/solver/cpu/alone/grid_elastic.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "server/solver/cpu/simd/vec8-inl.h"
#include "server/solver/cpu/step/grid_elastic-inl.h"
#include "server/solver/cpu/step/step_context.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// Coordinates of a row: x of all columns, then y, then z, `pitch` numbers each.
class CoordinateRow {
 public:
  CoordinateRow(float* x, size_t pitch) : x_(x), pitch_(pitch) {}

  HWY_INLINE Vectors8 at(int column) const {
    const float* const x = x_ + column;
    return {LoadEight(x), LoadEight(x + pitch_), LoadEight(x + 2 * pitch_)};
  }
  HWY_INLINE void Set(int column, const Vectors8& v) const {
    float* const x = x_ + column;
    StoreEight(v.x, x);
    StoreEight(v.y, x + pitch_);
    StoreEight(v.z, x + 2 * pitch_);
  }

 private:
  float* const x_;
  const size_t pitch_;
};

// A number of each column of a row.
struct NumberRow {
  HWY_INLINE Vec8 at(int column) const { return LoadEight(numbers + column); }

  const float* numbers;
};

CoordinateRow RowAt(const StepContext& context, float* coordinates, size_t row) {
  const size_t pitch = context.model.grid_elements.pitch;
  return {coordinates + row * 3 * pitch, pitch};
}

// Of up to eight particles; the others are 0.
template <class Value>
HWY_INLINE Vectors8 Turn(uint32_t count, const Value& value) {
  VectorPairs pairs;
  if (count >= kVec8Size) {
#pragma GCC unroll 4
    for (uint32_t k = 0; k < kVec4Size; ++k) pairs[k] = JoinVectors(value(k), value(k + kVec4Size));
    return Transpose(pairs);
  }
  for (uint32_t k = 0; k < kVec4Size; ++k) {
    const Vec4 low = k < count ? value(k) : Vec4{};
    const Vec4 high = k + kVec4Size < count ? value(k + kVec4Size) : Vec4{};
    pairs[k] = JoinVectors(low, high);
  }
  return Transpose(pairs);
}

// Lays rows of particles out by coordinates.
void TurnRows(const StepContext& context, const Vec4* positions, uint32_t begin, uint32_t end) {
  const GridElements& grid = context.model.grid_elements;
  const GridElasticScratch& scratch = context.scratch.grid_elastic;
  const float interval = context.substep.interval;
  for (uint32_t row = begin; row < end; ++row) {
    const CoordinateRow turned_positions = RowAt(context, scratch.positions, row);
    const CoordinateRow turned_velocities = RowAt(context, scratch.velocities, row);
    for (uint32_t column = 0; column < grid.columns; column += kVec8Size) {
      const size_t first = size_t{row} * grid.columns + column;
      const Vec4* const b = context.scratch.state.positions.data() + first;
      const Vec4* const u = context.scratch.state.velocities.data() + first;
      const uint32_t count = std::min(grid.columns - column, kVec8Size);
      const int at = static_cast<int>(column);
      if (positions != nullptr) {
        turned_positions.Set(at, Turn(count, [&](uint32_t k) { return positions[first + k]; }));
      } else {
        turned_positions.Set(at, Turn(count, [&](uint32_t k) { return b[k] + interval * u[k]; }));
      }
      if (grid.has_shear) {
        turned_velocities.Set(at, Turn(count, [&](uint32_t k) { return u[k]; }));
      }
    }
  }
}

// What grid_elastic-inl.h works on. `kAsks`: somebody asks for impulses.
template <bool kAsks>
class EightColumns {
 public:
  using Scalars = Vec8;
  using Vectors = Vectors8;
  static constexpr int kStep = kVec8Size;

  EightColumns(const StepContext& context, float* forces, float duration)
      : context_(context),
        columns_(context.model.grid_elements.columns),
        pitch_(context.model.grid_elements.pitch),
        strengths_(*context.controls.grid_strengths),
        forces_(forces),
        duration_(Splat8(duration)),
        u_(context.scratch.state.velocities.data()) {}

  static void Begin(uint32_t) {}
  static Vec8 Splat(float value) { return Splat8(value); }
  CoordinateRow Positions(uint32_t row) const {
    return RowAt(context_, context_.scratch.grid_elastic.positions, row);
  }
  CoordinateRow Velocities(uint32_t row) const {
    return RowAt(context_, context_.scratch.grid_elastic.velocities, row);
  }
  CoordinateRow Forces(GridFamily family, uint32_t row) const {
    return RowAt(context_, forces_, KeptRow(family, row));
  }
  NumberRow Stiffnesses(GridFamily family, size_t row) const {
    return {strengths_.Stiffnesses(family) + row * pitch_};
  }
  NumberRow Dampings(GridFamily family, size_t row) const {
    return {strengths_.Dampings(family) + row * pitch_};
  }
  // Rows of vectors begin at even columns.
  HWY_INLINE static Vectors8 WhereEven(uint32_t row, int, const Vectors8& a, const Vectors8& b) {
    alignas(32) static constexpr float kLanes[] = {1, -1, 1, -1, 1, -1, 1, -1, 1};
    const Mask8 is_even = LoadEight(kLanes + row % 2) > Vec8{};
    return {Select(is_even, a.x, b.x), Select(is_even, a.y, b.y), Select(is_even, a.z, b.z)};
  }
  HWY_INLINE void Push(size_t row, int column, const Vectors8& force) const {
    const Vec8 factor =
        LoadEight(strengths_.inverse_masses.data() + row * pitch_ + column) * duration_;
    const VectorPairs changes = Transpose(factor * force);
    Vec4* const u = u_ + row * columns_ + column;
    const uint32_t count = std::min(columns_ - static_cast<uint32_t>(column), kVec8Size);
    if constexpr (kAsks) PullHeld(u, count, Transpose(duration_ * force));
    if (context_.held.has_grips) return PushFree(u, count, changes);
#pragma GCC unroll 4
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      const auto [low, high] = SplitVectors(changes[k]);
      if (k < count) u[k] += low;
      if (k + kVec4Size < count) u[k + kVec4Size] += high;
    }
  }

 private:
  void PullHeld(const Vec4* u, uint32_t count, const VectorPairs& impulses) const {
    const auto first = static_cast<uint32_t>(u - u_);
    for (uint32_t k = 0; k < count; ++k) {
      if (context_.held.IsFree(first + k)) continue;
      const auto [low, high] = SplitVectors(impulses[k % kVec4Size]);
      context_.impulses()->Pull(first + k, k < kVec4Size ? low : high);
    }
  }

  // The strengths know the pins alone: what grips hold stays.
  void PushFree(Vec4* u, uint32_t count, const VectorPairs& changes) const {
    const size_t first = static_cast<size_t>(u - u_);
    for (uint32_t k = 0; k < count; ++k) {
      const auto [low, high] = SplitVectors(changes[k % kVec4Size]);
      const bool is_free = context_.held.inverse_masses[first + k] != 0;
      if (is_free) u[k] += k < kVec4Size ? low : high;
    }
  }

  const StepContext& context_;
  const uint32_t columns_;
  const uint32_t pitch_;
  const GridStrengths& strengths_;
  float* const forces_;
  const Vec8 duration_;
  Vec4* const u_;
};

template <bool kAsks>
void KickRowsOf(const StepContext& context, float duration, uint32_t begin, uint32_t end,
                uint32_t member) {
  EightColumns<kAsks> columns(context, context.scratch.grid_elastic.ForcesOf(member), duration);
  GridElastic(columns, context.model.grid_elements, context.controls.grid_strengths->rest_length)
      .Run(begin, end);
}

void KickRows(const StepContext& context, float duration, uint32_t begin, uint32_t end,
              uint32_t member) {
  if (context.impulses() != nullptr) {
    KickRowsOf<true>(context, duration, begin, end, member);
  } else {
    KickRowsOf<false>(context, duration, begin, end, member);
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace drape::cpu {

HWY_EXPORT(TurnRows);
HWY_EXPORT(KickRows);

void ApplyGridElastic(const StepContext& context, const Vec4* positions, float duration) {
  const GridElements& grid = context.model.grid_elements;
  context.ForRanges(grid.rows, kRowGrain, [&](size_t begin, size_t end) {
    HWY_DYNAMIC_DISPATCH(TurnRows)
    (context, positions, static_cast<uint32_t>(begin), static_cast<uint32_t>(end));
  });
  context.team.AnyOf(0, grid.rows, kRowGrain, [&](size_t begin, size_t end, uint32_t member) {
    HWY_DYNAMIC_DISPATCH(KickRows)
    (context, duration, static_cast<uint32_t>(begin), static_cast<uint32_t>(end), member);
    return false;
  });
}

}  // namespace drape::cpu
#endif  // HWY_ONCE
