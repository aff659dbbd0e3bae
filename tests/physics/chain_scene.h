// The product's scene of an exact chain. Header only.
#pragma once

#include "tests/support/planar_chain.h"
#include "tests/support/scenes.h"

namespace drape::test {

// With the same positions, velocities and masses; particle 0 is the pivot, pinned.
inline Scene SceneOf(const PlanarChain& chain) {
  ParticleTopology particles;
  particles.positions_m = chain.Positions_m();
  particles.masses_kg = {1};
  for (uint32_t k = 0; k < chain.links().size(); ++k) {
    particles.masses_kg.push_back(chain.links()[k].mass_kg);
    particles.distance_constraints.push_back({k, k + 1, chain.links()[k].length_m, 0});
  }
  Scene scene = Particles(particles, {0});
  scene.state.velocities_m_per_s = chain.Velocities_m_per_s();
  return scene;
}

}  // namespace drape::test
