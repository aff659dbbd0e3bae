// Spring forces. Pure functions.
#pragma once

#include <vector>

#include "server/scene/particle_state.h"
#include "server/scene/scene_model.h"

namespace drape {

// The force of its springs and their dampers on particle i [N].
Eigen::Vector3d SpringForceOn(const SceneModel& model, const ParticleState& state, uint32_t i);

// A_i(p, v) of server/solver/method.md: the acceleration of every particle by its springs and their
// dampers [m/s^2], [particle_count]; 0 for pins (Bender et al. 2009, section 4.1).
std::vector<Eigen::Vector3d> SpringAccelerations(const SceneModel& model,
                                                 const ParticleState& state);

}  // namespace drape
