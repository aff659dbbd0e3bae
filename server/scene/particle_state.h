// The mutable part of a cloth.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace drape {

// Positions and velocities in the cloth's own frame: axes of its environment, origin at the cloth's
// origin (see placement.h), so that the digits of single precision describe the cloth and not its
// place in the world.
struct ParticleState {
  std::vector<Eigen::Vector3d> positions_m;         // [particle_count]
  std::vector<Eigen::Vector3d> velocities_m_per_s;  // [particle_count]
};

}  // namespace drape
