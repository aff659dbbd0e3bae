// Stage `apply_elastic` of the grids of a group of cloths. Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_GRID_ELASTIC_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_GRID_ELASTIC_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_GRID_ELASTIC_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_GRID_ELASTIC_INL_H_
#endif

#include <algorithm>

#include "server/solver/cpu/side_by_side/advance-inl.h"
#include "server/solver/cpu/side_by_side/state-inl.h"
#include "server/solver/cpu/step/grid_elastic-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// Vectors of the columns of a row.
struct VectorRow {
  HWY_INLINE const VectorsCloths& at(int column) const { return vectors[column]; }
  HWY_INLINE void Set(int column, const VectorsCloths& v) const { Assign(vectors[column], v); }

  VectorsCloths* vectors;
};

// The velocities of the particles of a row; outside it any: no element acts there.
struct VelocityRow {
  HWY_INLINE const VectorsCloths& at(int column) const {
    return particles[std::clamp(column, 0, last)].u;
  }

  const ClothParticle* particles;
  int last;
};

// A number of the elements of a row: the same of all cloths, or of each.
struct StrengthRow {
  HWY_INLINE VecCloths at(int column) const {
    if (elements != nullptr && elements[column] != 0) [[unlikely]] {
      const uint32_t place = own_pins->element_places[elements[column] - 1];
      if (place != 0) return own_pins->elements[place].*own;
    }
    return SplatCloths(numbers[column]);
  }

  const float* numbers;
  const uint32_t* elements;  // GridElements::elements; null: all cloths have the same numbers
  const OwnPins* own_pins;
  VecCloths OwnElement::*own;
};

// What grid_elastic-inl.h works on. position(i) of each particle is asked for once, before a row of
// particles is changed that its elements touch. `kAsks`: somebody asks for impulses.
template <class PositionOf, bool kAsks>
class ClothColumns {
 public:
  using Scalars = VecCloths;
  using Vectors = VectorsCloths;
  static constexpr int kStep = 1;

  ClothColumns(const GroupContext& context, const PositionOf& position, float duration)
      : context_(context),
        grid_(context.model.grid_elements),
        strengths_(*context.controls.grid_strengths),
        position_(position),
        duration_(SplatCloths(duration)),
        positions_(context.impulses),
        forces_(context.impulses + kKeptPositions * RowLength()) {
    Clear();
  }

  static VecCloths Splat(float value) { return SplatCloths(value); }
  HWY_INLINE void Begin(uint32_t row) const {
    VectorsCloths* const kept = Positions(row).vectors;
    for (uint32_t column = 0; column < grid_.columns; ++column) {
      Assign(kept[column], position_(row * grid_.columns + column));
    }
  }
  VectorRow Positions(uint32_t row) const {
    return {positions_ + (row % kKeptPositions) * RowLength() + 1};
  }
  VelocityRow Velocities(uint32_t row) const {
    return {context_.particles + size_t{row} * grid_.columns, static_cast<int>(grid_.columns) - 1};
  }
  VectorRow Forces(GridFamily family, uint32_t row) const {
    return {forces_ + KeptRow(family, row) * RowLength() + 1};
  }
  StrengthRow Stiffnesses(GridFamily family, uint32_t row) const {
    return Strengths(strengths_.Stiffnesses(family), family, row, &OwnElement::stiffness);
  }
  StrengthRow Dampings(GridFamily family, uint32_t row) const {
    return Strengths(strengths_.Dampings(family), family, row, &OwnElement::damping);
  }
  HWY_INLINE static const VectorsCloths& WhereEven(uint32_t row, int column, const VectorsCloths& a,
                                                   const VectorsCloths& b) {
    return (row + static_cast<uint32_t>(column)) % 2 == 0 ? a : b;
  }
  HWY_INLINE void Push(uint32_t row, int column, const VectorsCloths& force) const {
    const uint32_t i = row * grid_.columns + static_cast<uint32_t>(column);
    if constexpr (kAsks) {
      if (context_.given->IsHeld(i)) context_.given->Pull(i, duration_ * force);
    }
    const VecCloths factor = context_.InverseMass(i) * duration_;
    ClothParticle& particle = context_.particles[i];
    Assign(particle.u, particle.u + factor * force);
  }

 private:
  size_t RowLength() const { return grid_.columns + size_t{2}; }
  // The places beside the rows stay 0.
  void Clear() const {
    const VecCloths zero = SplatCloths(0);
    for (uint32_t k = 0; k < kKeptPositions + kAllKeptRows; ++k) {
      Assign(context_.impulses[k * RowLength()], {zero, zero, zero});
      Assign(context_.impulses[(k + 1) * RowLength() - 1], {zero, zero, zero});
    }
  }
  StrengthRow Strengths(const float* numbers, GridFamily family, uint32_t row,
                        VecCloths OwnElement::*own) const {
    const size_t first = size_t{row} * grid_.pitch;
    const uint32_t* const elements =
        context_.has_own_pins() ? grid_.Of(family).data() + first : nullptr;
    return {numbers + first, elements, &context_.own_pins, own};
  }

  const GroupContext& context_;
  const GridElements& grid_;
  const GridStrengths& strengths_;
  const PositionOf& position_;
  const VecCloths duration_;
  VectorsCloths* const positions_;  // [kKeptPositions][1 + columns + 1]
  VectorsCloths* const forces_;     // [kAllKeptRows][1 + columns + 1]
};

template <bool kAsks, class PositionOf>
void ApplyGridElasticTo(const GroupContext& context, const PositionOf& position, float duration) {
  ClothColumns<PositionOf, kAsks> columns(context, position, duration);
  GridElastic(columns, context.model.grid_elements, context.controls.grid_strengths->rest_length)
      .Run(0, context.model.grid_elements.rows);
}

template <class PositionOf>
void ApplyGridElastic(const GroupContext& context, const PositionOf& position, float duration) {
  if (context.given != nullptr) return ApplyGridElasticTo<true>(context, position, duration);
  ApplyGridElasticTo<false>(context, position, duration);
}

// Whether the elements of a grid are all that acts.
bool IsGridElasticAlone(const GroupContext& context) {
  const FloatControls& controls = context.controls;
  return controls.grid_strengths != nullptr && !controls.Has(StepStage::kApplySprings) &&
         !controls.Has(StepStage::kApplyWind);
}

// From b + H u, settling open stages on the way, while the caches have the particles of a row.
void KickGridWithin(GroupContext& context) {
  WithVisit(context, [&](const auto& visit) {
    const bool is_open = context.open.any();
    const auto position = [&](uint32_t i) __attribute__((always_inline)) {
      if (is_open && context.IsFree(i)) visit(i);
      const ClothParticle& particle = context.particles[i];
      return particle.p + particle.u * context.substep.interval;
    };
    ApplyGridElastic(context, position, context.substep.kick_within);
  });
  context.open = {};
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
