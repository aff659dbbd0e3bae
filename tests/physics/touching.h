// Cloths that touch each other or themselves.
#pragma once

#include <cstdint>

#include "tests/physics/physics_test.h"

namespace drape::test {

// At which layers touch.
inline constexpr double kLayerThickness_m = 0.004;

// Settings of REALTIME without sleep; the cloth touches others of its world.
inline void Touch(Scene& scene, double friction = 0.3, uint32_t substeps = 20) {
  scene.parameters.settings = PresetSettings(Preset::kRealtime);
  scene.parameters.settings.substeps = substeps;
  scene.parameters.settings.sleep_motion_m = 0;
  scene.parameters.friction_static = scene.parameters.friction_dynamic = friction;
  scene.parameters.thickness_m = kLayerThickness_m;
}

// It touches itself, too.
inline void TouchItself(Scene& scene) {
  scene.parameters.self_collision = SelfCollision{};
}

}  // namespace drape::test
