// Starting states of the tests of stages.
#pragma once

#include <vector>

#include "tests/support/scenes.h"

namespace drape::test {

// Particles of different masses that nothing holds together.
inline Scene LooseParticles(const std::vector<Eigen::Vector3d>& positions) {
  ParticleTopology particles;
  particles.positions_m = positions;
  for (size_t i = 0; i < positions.size(); ++i)
    particles.masses_kg.push_back(0.1 + 0.3 * static_cast<double>(i));
  return Particles(particles);
}

inline void SetSubsteps(Scene& scene, uint32_t substeps, uint32_t max_iterations = 1) {
  scene.parameters.settings.substeps = substeps;
  scene.parameters.settings.max_iterations = max_iterations;
}

}  // namespace drape::test
