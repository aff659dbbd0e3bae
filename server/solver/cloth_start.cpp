#include "server/solver/cloth_start.h"

#include <vector>

namespace drape {

ClearStart FindClearStart(const SceneModel& model, const ClothParameters& parameters,
                          std::span<const Eigen::Vector3d> positions_m) {
  std::vector<Collider> colliders = parameters.colliders;
  for (size_t k = 0; k < parameters.collider_motions.size(); ++k) {
    colliders[k] = Moved(colliders[k], parameters.collider_motions[k]);
  }
  const Eigen::Vector3d& gravity = parameters.gravity_m_per_s2;
  const Eigen::Vector3d up =
      gravity.isZero(0) ? Eigen::Vector3d::UnitY() : Eigen::Vector3d(-gravity.stableNormalized());
  return ClearOfColliders(model.length_demands(), {colliders, parameters.thickness_m}, up,
                          positions_m);
}

}  // namespace drape
