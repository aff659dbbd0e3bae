// A sheet that falls onto something, watched step by step.
#pragma once

#include <algorithm>
#include <cstdint>

#include "tests/physics/physics_test.h"

namespace drape::test {

// A square sheet of side x side particles, centred over the origin at height 0; 8 substeps of two
// sweeps.
inline Scene CentredSheet(uint32_t side, double width_m, double friction,
                          const Collider& collider) {
  Scene scene = Grid(side, side, width_m, width_m);
  for (Eigen::Vector3d& p : scene.state.positions_m)
    p -= Eigen::Vector3d(width_m / 2, 0, width_m / 2);
  scene.parameters.colliders = {collider};
  scene.parameters.friction_static = scene.parameters.friction_dynamic = friction;
  scene.parameters.settings = SingleSubstep(1.0 / 60, 2);
  scene.parameters.settings.substeps = 8;
  return scene;
}

// Measures after one of the steps.
struct WatchedStep {
  double deepest_m = 0;      // of the particles, 0 where none is inside
  double reported_m = 0;     // the same by the report
  double speed_m_per_s = 0;  // largest of a particle, after this and all steps before
};

// Steps `cloth` and shows each step to `check(const WatchedStep&)`. `depth_m(position)`: the depth
// of a position inside the collider below. Returns the most particles that touched it at once.
template <class Depth, class Check>
uint32_t WatchFall(Backend& backend, ClothHandle cloth, const Scene& scene, int steps,
                   const Depth& depth_m, const Check& check) {
  uint32_t contacts = 0;
  double speed_m_per_s = 0;
  for (int step = 0; step < steps; ++step) {
    SCOPED_TRACE("step " + std::to_string(step));
    const StepReport report = StepAlone(backend, cloth, scene, 1, /*measure=*/true);
    contacts = std::max(contacts, report.measured.contacts);
    const ParticleState state = ReadState(backend, cloth);
    double deepest_m = 0;
    for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
      deepest_m = std::max(deepest_m, depth_m(state.positions_m[i]));
      speed_m_per_s = std::max(speed_m_per_s, state.velocities_m_per_s[i].norm());
    }
    check(WatchedStep{deepest_m, report.measured.max_penetration_m, speed_m_per_s});
  }
  return contacts;
}

}  // namespace drape::test
