// Along which lines the impulses of distance constraints act (settings.direction;
// server/solver/method.md, "Direction").
#pragma once

#include <Eigen/Core>

namespace drape {

// The direction of an impulse, and its slope, (0, 1]: the share of a displacement along it that
// changes the length, direction . (unit direction at the end of the substep).
struct ImpulseLine {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
  double slope = 1;
};

// d / |d|, or +x where d is too short to have a direction.
Eigen::Vector3d DirectionOf(const Eigen::Vector3d& d);

// The line of a constraint between particles that are start_m apart at the start of a substep and
// predicted_m at its end; `end_share` as in SolverChoice.
ImpulseLine BlendDirections(const Eigen::Vector3d& start_m, const Eigen::Vector3d& predicted_m,
                            double end_share);

}  // namespace drape
