#include "server/solver/update_check.h"

#include <string>

namespace drape {
namespace {

Status CheckSize(const char* list, size_t size, size_t wanted) {
  if (size == wanted) return Status::Ok();
  return {StatusCode::kInternal, "SIZES_DISAGREE",
          std::string(list) + " has " + std::to_string(size) + " entries, the cloth needs " +
              std::to_string(wanted) + "; nothing has been changed"};
}

Status CheckState(const SceneModel& model, const ParticleState& state) {
  DRAPE_RETURN_IF_ERROR(CheckSize("positions_m", state.positions_m.size(), model.particle_count()));
  return CheckSize("velocities_m_per_s", state.velocities_m_per_s.size(), model.particle_count());
}

// Empty: the colliders rest, and none is a body.
Status CheckMotions(const std::vector<RigidMotion>& motions,
                    const std::vector<Collider>& colliders) {
  if (motions.empty() && !HasBodies(colliders)) return Status::Ok();
  return CheckSize("collider_motions", motions.size(), colliders.size());
}

}  // namespace

Status CheckUpdateFits(const SceneModel& model, const ClothParameters& parameters,
                       const ClothUpdate& update) {
  const SceneModel& after = update.model != nullptr ? *update.model : model;
  const ClothParameters& numbers = update.parameters ? *update.parameters : parameters;
  DRAPE_RETURN_IF_ERROR(CheckSize("model", after.particle_count(), model.particle_count()));
  if (update.state) DRAPE_RETURN_IF_ERROR(CheckState(after, *update.state));
  if (update.pin_targets_m) {
    DRAPE_RETURN_IF_ERROR(
        CheckSize("pin_targets_m", update.pin_targets_m->size(), after.pin_count()));
  }
  if (update.rest_lengths_m && !update.rest_lengths_m->empty()) {
    DRAPE_RETURN_IF_ERROR(
        CheckSize("rest_lengths_m", update.rest_lengths_m->size(), after.constraint_count()));
  }
  const auto& motions =
      update.collider_motions ? *update.collider_motions : numbers.collider_motions;
  return CheckMotions(motions, numbers.colliders);
}

Status CheckStateFits(const SceneModel& model, const ClothParameters& parameters,
                      const ParticleState& state) {
  DRAPE_RETURN_IF_ERROR(CheckState(model, state));
  return CheckMotions(parameters.collider_motions, parameters.colliders);
}

}  // namespace drape
