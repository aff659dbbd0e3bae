#include "server/solver/cpu_reference/reference_twist.h"

namespace drape {

void DampTwist(const SceneModel& model, double share, std::vector<Eigen::Vector3d>& u) {
  const uint32_t columns = model.grid_columns();
  const auto w = model.inverse_masses_per_kg();
  const std::vector<Eigen::Vector3d> before = u;
  for (uint32_t row = 0; row + 1 < model.grid_rows(); ++row) {
    for (uint32_t column = 0; column + 1 < columns; ++column) {
      const uint32_t i00 = row * columns + column, i10 = i00 + columns;
      const Eigen::Vector3d twist =
          (before[i00] - before[i00 + 1]) - (before[i10] - before[i10 + 1]);
      const auto add = [&](uint32_t i, double sign) {
        if (w[i] != 0) u[i] += sign * share * twist;
      };
      add(i00, -1);
      add(i00 + 1, 1);
      add(i10, 1);
      add(i10 + 1, -1);
    }
  }
}

}  // namespace drape
