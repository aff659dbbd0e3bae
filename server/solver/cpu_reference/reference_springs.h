// Spring forces. Pure functions.
#pragma once

#include <vector>

#include "server/scene/particle_state.h"
#include "server/scene/scene_model.h"

namespace drape {

// A_i(p, v) of server/solver/README.md: the acceleration of every particle by its springs and their
// dampers [m/s^2], [particle_count]; 0 for pins (Bender et al. 2009, section 4.1).
std::vector<Eigen::Vector3d> SpringAccelerations(const SceneModel& model,
                                                 const ParticleState& state);

// Whether explicit springs may be unstable at this substep. M^-1 K has the row sums
// w_i (sum k + sum k) where all springs of i pull along one line, which bounds the largest squared
// frequency (Gershgorin); the leapfrog scheme needs h^2 omega^2 < 4.
bool AreSpringsBeyondLimit(const SceneModel& model, double substep_s);

}  // namespace drape
