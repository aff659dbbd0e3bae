#include "server/solver/surface_contact/surface_parts.h"

#include <algorithm>

namespace drape {

SurfaceParts::SurfaceParts(const SceneModel& model, Interruption* interruption) {
  const auto add = [&](uint32_t i, uint32_t j) {
    edges_.push_back({std::min(i, j), std::max(i, j)});
  };
  triangles_.assign(model.triangles().begin(), model.triangles().end());
  for (const auto& [a, b, c] : triangles_) {
    add(a, b);
    add(b, c);
    add(c, a);
  }
  if (triangles_.empty()) {
    for (const DistanceConstraint& link : model.constraints()) {
      if (link.kind == ConstraintKind::kEqual) add(link.i, link.j);
    }
  }
  Ask(interruption);
  std::ranges::sort(edges_);
  Ask(interruption);
  edges_.erase(std::ranges::unique(edges_).begin(), edges_.end());
  for (const auto& [i, j] : edges_) {
    const Eigen::Vector3d edge = model.rest_positions_m()[j] - model.rest_positions_m()[i];
    longest_m_ = std::max(longest_m_, edge.norm());
  }
}

}  // namespace drape
