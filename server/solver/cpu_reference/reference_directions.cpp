#include "server/solver/cpu_reference/reference_directions.h"

#include "server/solver/solver_constants.h"

namespace drape {

using Eigen::Vector3d;

Vector3d DirectionOf(const Vector3d& d) {
  const double length = d.norm();
  return length < kMinDirectionLength_m ? Vector3d::UnitX() : Vector3d(d / length);
}

ImpulseLine BlendDirections(const Vector3d& start_m, const Vector3d& predicted_m,
                            double end_share) {
  const Vector3d at_end = DirectionOf(predicted_m);
  if (end_share == 1) return {at_end, 1};
  const Vector3d at_start = DirectionOf(start_m);
  if (!(at_start.dot(at_end) >= kMinDirectionCosine)) return {at_end, 1};
  const Vector3d mean = (1 - end_share) * at_start + end_share * at_end;
  return {mean, mean.dot(at_end)};
}

}  // namespace drape
