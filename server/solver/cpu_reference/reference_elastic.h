// Forces of elastic elements: bending and shear. Pure functions.
#pragma once

#include <vector>

#include "server/scene/particle_state.h"
#include "server/scene/scene_model.h"

namespace drape {

// Change of velocity of every particle by the elastic elements within `duration_s`, part of a
// substep of `substep_s` [m/s], [particle_count]; 0 for pins. What is faster than
// `max_frequency_sq_per_s2` acts as if it were not.
std::vector<Eigen::Vector3d> ElasticVelocityChanges(const SceneModel& model,
                                                    const ParticleState& state, double duration_s,
                                                    double substep_s,
                                                    double max_frequency_sq_per_s2);
// The impulses behind it [N s], on pins too.
std::vector<Eigen::Vector3d> ElasticImpulses(const SceneModel& model, const ParticleState& state,
                                             double duration_s, double substep_s,
                                             double max_frequency_sq_per_s2);

}  // namespace drape
