#include "server/solver/cpu/alone/twist.h"

#include <algorithm>

namespace drape::cpu {
namespace {

// Row `row` of the cells, those above this row of particles, times the share; the cells beyond the
// edges of the grid are 0.
void StoreTwists(const StepContext& context, uint32_t row) {
  const uint32_t columns = context.model.source->grid_columns();
  Vec4* const twists = context.scratch.twists.data() + row * (columns + size_t{1});
  if (row == 0 || row == context.model.source->grid_rows()) {
    std::fill(twists, twists + columns + 1, Vec4{});
    return;
  }
  const Vec4* const lower = context.scratch.state.velocities.data() + size_t{row} * columns;
  const Vec4* const upper = lower - columns;
  const float share = context.substep.twist_share;
  twists[0] = twists[columns] = Vec4{};
  for (uint32_t column = 0; column + 1 < columns; ++column) {
    twists[column + 1] =
        share * ((upper[column] - upper[column + 1]) - (lower[column] - lower[column + 1]));
  }
}

// The particles of a row, from the cells around them.
void ApplyTwists(const StepContext& context, uint32_t row) {
  const uint32_t columns = context.model.source->grid_columns();
  const Vec4* const above = context.scratch.twists.data() + row * (columns + size_t{1});
  const Vec4* const below = above + columns + 1;
  Vec4* const u = context.scratch.state.velocities.data() + size_t{row} * columns;
  const float* const w = context.held.inverse_masses.data() + size_t{row} * columns;
  for (uint32_t column = 0; column < columns; ++column) {
    const Vec4 change = (above[column + 1] - above[column]) + (below[column] - below[column + 1]);
    if (w[column] != 0) u[column] += change;
  }
}

// What is held, from the cells around it.
void PullByTwists(const StepContext& context) {
  const uint32_t columns = context.model.source->grid_columns();
  context.ForHeldAsked([&](uint32_t i, ImpulseSums& sums) {
    const Vec4* const above =
        context.scratch.twists.data() + (i / columns) * (columns + size_t{1}) + i % columns;
    const Vec4* const below = above + columns + 1;
    const Vec4 change = (above[1] - above[0]) + (below[0] - below[1]);
    sums.Pull(i, static_cast<float>(context.model.source->masses_kg()[i]) * change);
  });
}

}  // namespace

void DampTwist(const StepContext& context) {
  if (context.substep.twist_share == 0) return;
  const uint32_t columns = context.model.source->grid_columns();
  const uint32_t rows = context.model.source->grid_rows();
  context.scratch.twists.resize((rows + size_t{1}) * (columns + size_t{1}));
  context.ForRanges(rows + size_t{1}, kRowGrain, [&](size_t begin, size_t end) {
    for (size_t row = begin; row < end; ++row) StoreTwists(context, static_cast<uint32_t>(row));
  });
  context.ForRanges(rows, kRowGrain, [&](size_t begin, size_t end) {
    for (size_t row = begin; row < end; ++row) ApplyTwists(context, static_cast<uint32_t>(row));
  });
  PullByTwists(context);
}

}  // namespace drape::cpu
