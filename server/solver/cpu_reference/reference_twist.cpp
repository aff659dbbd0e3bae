#include "server/solver/cpu_reference/reference_stages.h"

namespace drape::reference {

// Every cell of the grid gives its corners a share of its twist s = u_00 - u_01 - u_10 + u_11 back,
// with the signs of s: u_00 -= share s, u_01 += share s, ...; all s from the same u. Pins stay as
// they are. Conserves momentum where the masses are equal, as those of a grid are.
void DampTwist(StepContext& context) {
  const double share = context.substep.twist_share;
  if (share == 0) return;
  const SceneModel& model = context.model;
  const uint32_t columns = model.grid_columns();
  const std::vector<Eigen::Vector3d> before = context.u;
  for (uint32_t row = 0; row + 1 < model.grid_rows(); ++row) {
    for (uint32_t column = 0; column + 1 < columns; ++column) {
      const uint32_t i00 = row * columns + column, i10 = i00 + columns;
      const Eigen::Vector3d twist =
          (before[i00] - before[i00 + 1]) - (before[i10] - before[i10 + 1]);
      const auto add = [&](uint32_t i, double sign) {
        if (context.w[i] != 0) context.u[i] += sign * share * twist;
        context.Pull(i, model.masses_kg()[i] * sign * share * twist);
      };
      add(i00, -1);
      add(i00 + 1, 1);
      add(i10, 1);
      add(i10 + 1, -1);
    }
  }
}

}  // namespace drape::reference
