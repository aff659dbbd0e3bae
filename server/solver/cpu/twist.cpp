#include "server/solver/cpu/twist.h"

#include <algorithm>

namespace drape::cpu {
namespace {

// The twist of the cells of one row times the share; one more at each end that is 0.
void StoreTwists(const Lanes* upper, const Lanes* lower, uint32_t columns, float share,
                 Lanes* twists) {
  for (uint32_t column = 0; column + 1 < columns; ++column) {
    twists[column + 1] =
        share * ((upper[column] - upper[column + 1]) - (lower[column] - lower[column + 1]));
  }
}

}  // namespace

void DampTwist(const StepContext& context) {
  const FloatModel& model = context.model;
  const uint32_t columns = model.source->grid_columns(), rows = model.source->grid_rows();
  std::vector<Lanes>& twists = context.scratch.twists;
  twists.assign(2 * (columns + size_t{1}), Lanes{});
  Lanes* above = twists.data();  // of the cells above the row of particles
  Lanes* below = above + columns + 1;
  for (uint32_t row = 0; row < rows; ++row) {
    Lanes* const u = context.scratch.state.velocities.data() + size_t{row} * columns;
    if (row + 1 < rows) {
      StoreTwists(u, u + columns, columns, context.substep.twist_share, below);
    } else {
      std::fill(below, below + columns + 1, Lanes{});
    }
    const float* const w = model.inverse_masses.data() + size_t{row} * columns;
    for (uint32_t column = 0; column < columns; ++column) {
      const Lanes change =
          (above[column + 1] - above[column]) + (below[column] - below[column + 1]);
      if (w[column] != 0) u[column] += change;
    }
    std::swap(above, below);
  }
}

}  // namespace drape::cpu
