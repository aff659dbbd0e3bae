// Settings for tests that look at single stages of a step. Header only.
#pragma once

#include "server/solver/cloth_parameters.h"

namespace drape::test {

// 60 substeps of one sweep along strips, two steps, tethers; no twist damping, no refinement, no
// load limit, no sleep; particles alone touch colliders.
inline StepSettings PlainSettings() {
  StepSettings settings = PresetSettings(Preset::kRealtime);
  settings.substeps = 60;
  settings.twist_damping_per_s = 0;
  settings.refine_above_strain = 0;
  settings.load_limit = 0;
  settings.sleep_motion_m = 0;
  settings.collider_contact = ColliderContact::kParticles;
  return settings;
}

// No forces but gravity; PlainSettings.
inline ClothParameters PlainParameters() {
  ClothParameters parameters;
  parameters.settings = PlainSettings();
  return parameters;
}

}  // namespace drape::test
