// Reductions: a few numbers of each cloth in place of its positions. Pure.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>

#include "server/scene/placement.h"
#include "server/solver/backend.h"

namespace drape::api {

// Which are wanted.
struct ReductionSpec {
  bool coverage = false;
  bool centroid = false;
  bool box = false;
  bool target_distance = false;
  double coverage_radius_m = 0;  // half side of what a particle covers
  // In the environment, a column per particle; set with target_distance.
  std::shared_ptr<const Eigen::Matrix3Xd> target_m{};

  bool any() const { return coverage || centroid || box || target_distance; }
};

// Of one cloth, in the world; what was not wanted has no meaning.
struct Reductions {
  double coverage_m2 = 0;
  Eigen::Vector3d centroid_m = Eigen::Vector3d::Zero();
  Eigen::AlignedBox3d box_m;
  double target_distance_m = 0;
};

// Of the cloth whose positions, in its own frame, are the rows [first_row, first_row + row_count)
// of `positions_m`; row_count >= 1.
Reductions Reduce(const ReductionSpec& spec, const ScalarColumn& positions_m, size_t first_row,
                  size_t row_count, const Placement& placement);

}  // namespace drape::api
