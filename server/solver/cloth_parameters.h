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
  double damping_per_s = 0;     // >= 0; v decays as exp(-damping t)
  double friction_static = 0;   // >= friction_dynamic
  double friction_dynamic = 0;  // >= 0
  double thickness_m = 0;       // >= 0; gap = distance to the collider - thickness
  std::vector<Collider> colliders;
  StepSettings settings;
};

}  // namespace drape
