// What may change about a cloth while it runs without a new model.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "server/scene/colliders.h"
#include "server/solver/step_settings.h"

namespace drape {

// All in the cloth's own frame.
struct ClothParameters {
  Eigen::Vector3d gravity_m_per_s2{0, -9.81, 0};
  Eigen::Vector3d wind_m_per_s{0, 0, 0};  // velocity of the air; no effect without drag or lift
  double damping_per_s = 0;               // >= 0; v decays as exp(-damping t)
  double friction_static = 0;             // >= friction_dynamic
  double friction_dynamic = 0;            // >= 0
  double thickness_m = 0;                 // >= 0; gap = distance to the collider - thickness
  double air_drag = 0;                    // drag coefficient, [0, kMaxAirCoefficient]
  double air_lift = 0;                    // lift coefficient, [0, kMaxAirCoefficient]
  std::vector<Collider> colliders;
  StepSettings settings;
};

// Whether the stage `apply_wind` has anything to do. Cloths without triangles feel no air.
inline bool HasAirForces(const SceneModel& model, const ClothParameters& parameters) {
  return !model.triangles().empty() && (parameters.air_drag > 0 || parameters.air_lift > 0);
}

// Whether the cloth is advanced by two-step differences. Contacts are not smooth, and springs alone
// are better off with velocity Verlet.
inline bool UsesTwoSteps(const SceneModel& model, const ClothParameters& parameters) {
  const StepSettings& settings = parameters.settings;
  const bool has_spring_forces =
      model.spring_count() > 0 && settings.spring_integration == SpringIntegration::kInForce;
  return settings.integration == Integration::kTwoStep && settings.substeps > 1 &&
         model.constraint_count() > 0 && parameters.colliders.empty() && !has_spring_forces;
}

// Whether explicit springs may be unstable: velocity Verlet needs h^2 omega^2 < 4, two steps with
// the springs at the predicted positions less than the square of the golden ratio.
inline bool AreSpringsBeyondLimit(const SceneModel& model, const ClothParameters& parameters) {
  const double h = parameters.settings.substep_s();
  const double limit = UsesTwoSteps(model, parameters) ? 2.618 : 4;
  return h * h * model.spring_frequency_sq_bound() >= limit;
}

// Whether the stage `damp_twist` has anything to do: cells are those of a grid.
inline bool HasTwistDamping(const SceneModel& model, const StepSettings& settings) {
  return settings.twist_damping_per_s > 0 && model.grid_columns() > 1 && model.grid_rows() > 1;
}

}  // namespace drape
