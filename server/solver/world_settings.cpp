#include "server/solver/world_settings.h"

#include <algorithm>

namespace drape {

ClothParameters InWorld(ClothParameters parameters, const WorldSettings& settings) {
  parameters.settings.substeps = settings.substeps;
  parameters.settings.integration = settings.integration;
  return parameters;
}

WorldSettings SettingsOfWorld(std::span<const WorldCloth> cloths, ScalarType scalar) {
  WorldSettings settings{.substeps = 0, .integration = cloths[0].parameters->settings.integration};
  for (const WorldCloth& cloth : cloths) {
    settings.substeps = std::max(settings.substeps, cloth.parameters->settings.substeps);
    const bool wants_two_steps = cloth.parameters->settings.integration == Integration::kTwoStep;
    if (!wants_two_steps) settings.integration = Integration::kOneStep;
  }
  for (const WorldCloth& cloth : cloths) {
    const StepPlan plan =
        PlanStep(*cloth.model, InWorld(*cloth.parameters, settings), cloth.lengths, scalar);
    if (!plan.solver.has_two_steps) settings.integration = Integration::kOneStep;
  }
  return settings;
}

}  // namespace drape
