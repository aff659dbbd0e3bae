// Stage `damp_twist` of a group of cloths. Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_TWIST_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_TWIST_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_TWIST_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_TWIST_INL_H_
#endif

#include <algorithm>
#include <utility>

#include "server/solver/cpu/side_by_side/advance-inl.h"
#include "server/solver/cpu/side_by_side/state-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// The twist of the cells of one row times the share; one more at each end that is 0.
void StoreTwists(const ClothParticle* upper, const ClothParticle* lower, uint32_t columns,
                 float share, VectorsCloths* twists) {
  for (uint32_t column = 0; column + 1 < columns; ++column) {
    twists[column + 1] = SplatCloths(share) * ((upper[column].u - upper[column + 1].u) -
                                               (lower[column].u - lower[column + 1].u));
  }
}

// What is held, from the cells above and below it.
HWY_NOINLINE void PullByTwists(const GroupContext& context, uint32_t i, const VectorsCloths* above,
                               const VectorsCloths* below) {
  context.given->Pull(i, context.given->Mass(i) * ((above[1] - above[0]) + (below[0] - below[1])));
}

// Every cell of the grid gives its corners a share of its twist back (server/solver/method.md).
void DampTwist(GroupContext& context) {
  if (context.substep.twist_share == 0) return;
  Settle(context);
  const FloatModel& model = context.model;
  const uint32_t columns = model.source->grid_columns(), rows = model.source->grid_rows();
  const VectorsCloths none{SplatCloths(0), SplatCloths(0), SplatCloths(0)};
  VectorsCloths* above = context.twists;  // of the cells above the row of particles
  VectorsCloths* below = above + columns + 1;
  std::fill_n(above, 2 * (columns + size_t{1}), none);
  for (uint32_t row = 0; row < rows; ++row) {
    ClothParticle* const particles = context.particles + size_t{row} * columns;
    if (row + 1 < rows) {
      StoreTwists(particles, particles + columns, columns, context.substep.twist_share, below);
    } else {
      std::fill_n(below, columns + 1, none);
    }
    for (uint32_t column = 0; column < columns; ++column) {
      const uint32_t i = row * columns + column;
      if (context.given != nullptr && context.given->IsHeld(i)) {
        PullByTwists(context, i, above + column, below + column);
      }
      if (!context.IsFree(i)) continue;
      VectorsCloths change =
          (above[column + 1] - above[column]) + (below[column] - below[column + 1]);
      if (context.IsHeldBySome(i)) change = Select(context.FreeCloths(i), change, none);
      particles[column].u = particles[column].u + change;
    }
    std::swap(above, below);
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
