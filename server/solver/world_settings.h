// What the cloths of a world have in common while they are stepped together.
#pragma once

#include <cstdint>
#include <span>

#include "server/solver/cloth_parameters.h"
#include "server/solver/step_plan.h"

namespace drape {

struct WorldSettings {
  uint32_t substeps = 0;  // 0: a cloth's own
  Integration integration = Integration::kOneStep;

  friend bool operator==(const WorldSettings&, const WorldSettings&) = default;
};

// The parameters of a cloth whose world has these settings.
ClothParameters InWorld(ClothParameters parameters, const WorldSettings& settings);

// One cloth of a world.
struct WorldCloth {
  const SceneModel* model;
  const ClothParameters* parameters;
  LengthSource lengths;
};

// The substeps of the cloth that has most; two steps where all of them have them with so many
// substeps, else one. Pure.
WorldSettings SettingsOfWorld(std::span<const WorldCloth> cloths, ScalarType scalar);

}  // namespace drape
