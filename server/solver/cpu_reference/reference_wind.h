// Forces of the air on triangles. Pure functions.
#pragma once

#include <vector>

#include "server/scene/particle_state.h"
#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"

namespace drape {

// The velocity of a triangle relative to the air around it, after the air has acted on it for
// `duration_s` (server/solver/method.md): r' for r [m/s]. `area_vector_m2` is normal to the
// triangle and as long as its area is large. Never longer than r, and never on the other side of
// the triangle.
Eigen::Vector3d VelocityAfterAir(const Eigen::Vector3d& r, const Eigen::Vector3d& area_vector_m2,
                                 double mass_kg, const ClothParameters& parameters,
                                 double duration_s);

// Change of velocity of every particle by the air within `duration_s` [m/s], [particle_count];
// 0 for pins.
std::vector<Eigen::Vector3d> WindVelocityChanges(const SceneModel& model,
                                                 const ClothParameters& parameters,
                                                 const ParticleState& state, double duration_s);

// The impulses behind it [N s], on pins too.
std::vector<Eigen::Vector3d> WindImpulses(const SceneModel& model,
                                          const ClothParameters& parameters,
                                          const ParticleState& state, double duration_s);

}  // namespace drape
