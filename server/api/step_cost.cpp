#include "server/api/step_cost.h"

#include "server/api/field_checks.h"
#include "server/solver/solver_constants.h"

namespace drape::api {

Status CheckStepCost(const std::string& field, const SceneModel& model,
                     const StepSettings& settings, size_t collider_count) {
  const uint64_t pairs = uint64_t{model.particle_count()} * collider_count;
  if (pairs > kMaxParticleColliderPairs) {
    return Status::InvalidField("spec.environment.colliders",
                                std::to_string(collider_count) + " colliders for " +
                                    std::to_string(model.particle_count()) + " particles are " +
                                    std::to_string(pairs) + " pairs, at most " +
                                    std::to_string(kMaxParticleColliderPairs) + " are allowed");
  }
  // The load may change while the cloth runs, with gravity, pins and material.
  const double load_factor = settings.load_limit > 0 ? kMaxLoadFactor : 1;
  const double solves = load_factor * SolvesPerStep(model, settings, collider_count);
  if (solves <= kMaxSolvesPerStep) return Status::Ok();
  return Status::InvalidField(
      field, "make up to " + NumberText(solves) + " solves per step, at most " +
                 NumberText(kMaxSolvesPerStep) +
                 " are allowed: lower substeps, max_iterations or the number of colliders");
}

Status CheckStepCost(const ClothDescription& cloth, const ClothChange& change) {
  return CheckStepCost(cloth, *cloth.model, change);
}

Status CheckStepCost(const ClothDescription& cloth, const SceneModel& model,
                     const ClothChange& change) {
  const auto& colliders = change.colliders ? *change.colliders : cloth.parameters.colliders;
  return CheckStepCost("spec.settings", model, change.settings.value_or(cloth.parameters.settings),
                       colliders.size());
}

}  // namespace drape::api
