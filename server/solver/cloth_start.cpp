#include "server/solver/cloth_start.h"

#include <utility>
#include <vector>

#include "server/scene/start_fitting.h"

namespace drape {

ClearStart FindClearStart(const SceneModel& model, const ClothParameters& parameters,
                          std::span<const Eigen::Vector3d> positions_m, bool may_let_out,
                          Interruption* interruption) {
  std::vector<Collider> colliders = parameters.colliders;
  for (size_t k = 0; k < parameters.collider_motions.size(); ++k) {
    colliders[k] = Moved(colliders[k], parameters.collider_motions[k]);
  }
  const Eigen::Vector3d& gravity = parameters.gravity_m_per_s2;
  const Eigen::Vector3d up =
      gravity.isZero(0) ? Eigen::Vector3d::UnitY() : Eigen::Vector3d(-gravity.stableNormalized());
  const LengthDemands demands = model.length_demands();
  const AvoidedColliders avoided{colliders, parameters.thickness_m, interruption};
  ClearStart start = ClearOfColliders(demands, avoided, up, positions_m);
  if (!may_let_out) return start;
  const bool is_cleared = start.clearance == StartClearance::kCleared;
  FittedStart fitted = FitStart(demands, avoided, is_cleared ? start.positions_m : positions_m);
  if (fitted.positions_m.empty()) return start;
  return {.clearance = StartClearance::kCleared,
          .positions_m = std::move(fitted.positions_m),
          .errors = fitted.errors,
          .let_out = std::move(fitted.let_out),
          .largest_let_out = fitted.largest_change};
}

}  // namespace drape
