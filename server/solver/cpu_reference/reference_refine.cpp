#include "server/solver/cpu_reference/reference_refine.h"

#include <algorithm>
#include <cmath>

#include "server/solver/solver_constants.h"

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

void RefineLink(const SceneModel& model, uint32_t index, double interval_s,
                const std::vector<Eigen::Vector3d>& u, std::vector<Eigen::Vector3d>& base_m) {
  const auto& [i, j, rest_length_m, compliance, kind] = model.constraints()[index];
  const auto w = model.inverse_masses_per_kg();
  const Eigen::Vector3d d = (base_m[j] - base_m[i]) + interval_s * (u[j] - u[i]);
  const double length = d.norm();
  const Eigen::Vector3d n =
      length < kMinDirectionLength_m ? Eigen::Vector3d::UnitX() : Eigen::Vector3d(d / length);
  const double move = (length - rest_length_m) / (w[i] + w[j]);
  base_m[i] += w[i] * move * n;
  base_m[j] -= w[j] * move * n;
}

}  // namespace drape
