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
  double damping_per_s = 0;     // >= 0; v decays as exp(-damping t)
  double friction_static = 0;   // >= friction_dynamic
  double friction_dynamic = 0;  // >= 0
  double thickness_m = 0;       // >= 0; gap = distance to the collider - thickness
  double air_drag = 0;          // drag coefficient, [0, kMaxAirCoefficient]
  double air_lift = 0;          // lift coefficient, [0, kMaxAirCoefficient]
  std::vector<Collider> colliders;
  StepSettings settings;
};

// Whether the stage `apply_wind` has anything to do. Cloths without triangles feel no air.
inline bool HasAirForces(const SceneModel& model, const ClothParameters& parameters) {
  return !model.triangles().empty() && (parameters.air_drag > 0 || parameters.air_lift > 0);
}

}  // namespace drape
