#include "server/solver/cpu_reference/reference_refine.h"

#include <algorithm>
#include <cmath>

namespace drape {

std::vector<uint32_t> LinksToRefine(const StripPrediction& prediction, double strain,
                                    const std::vector<Eigen::Vector3d>& u) {
  const SceneModel& model = prediction.model;
  const double limit = std::max(strain, prediction.tolerance);
  std::vector<bool> is_at_far_off(model.particle_count(), false);
  for (const auto& [i, j, rest_length_m, compliance, kind] : model.constraints()) {
    const Eigen::Vector3d d =
        (prediction.base_m[j] - prediction.base_m[i]) + prediction.interval_s * (u[j] - u[i]);
    if (!(std::abs(d.norm() - rest_length_m) > limit * rest_length_m)) continue;
    is_at_far_off[i] = is_at_far_off[j] = true;
  }
  std::vector<uint32_t> links;
  for (uint32_t index = 0; index < model.constraint_count(); ++index) {
    const DistanceConstraint& constraint = model.constraints()[index];
    if (is_at_far_off[constraint.i] || is_at_far_off[constraint.j]) links.push_back(index);
  }
  return links;
}

}  // namespace drape
