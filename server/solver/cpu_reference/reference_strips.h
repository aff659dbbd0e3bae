// Stage `solve_strips`: all constraints of a path at once.
#pragma once

#include <span>
#include <vector>

#include "server/scene/scene_model.h"

namespace drape {

// The prediction that the strips of a substep are solved against: particle i is at base_m[i] +
// interval_s * u_i.
struct StripPrediction {
  const SceneModel& model;
  std::span<const Eigen::Vector3d> base_m;
  double end_share = 1;  // as in SolverChoice
  double interval_s = 0;
  double tolerance = 0;  // of |error| / rest length; 0: always solve
};

// One sweep over all strips, phase by phase: changes u [m/s] and the accumulated impulses lambda
// [N s] ([constraint_count]) by the impulses that remove the errors of each strip's constraints
// together (server/solver/method.md). Returns whether any strip was solved.
bool SolveStrips(const StripPrediction& prediction, std::vector<Eigen::Vector3d>& u,
                 std::vector<double>& lambda);

}  // namespace drape
