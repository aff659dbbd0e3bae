#include "server/session/cloth_update.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <variant>

#include "server/session/cloth_creation.h"

namespace drape {
namespace {

// Everything about one cloth's change, found out before anything is changed.
struct PlannedUpdate {
  std::shared_ptr<const ClothDescription> after;
  ClothUpdate write;
  ClothUpdate undo;
  std::optional<PinTrack> pins;  // set if they are replaced
};

std::vector<Eigen::Vector3d> PinsNow(const PinTrack& pins, double now_s) {
  std::vector<Eigen::Vector3d> positions_m;
  for (size_t k = 0; k < pins.pin_count(); ++k) positions_m.push_back(pins.At(k, now_s));
  return positions_m;
}

Eigen::Vector3d Row(const ScalarColumn& column, uint32_t row) {
  return std::visit(
      [&](const auto& values) {
        const auto* xyz = values.data() + 3 * size_t{row};
        return Eigen::Vector3d(xyz[0], xyz[1], xyz[2]);
      },
      column);
}

// The new pins: those that stay keep their motions, new ones start where their particle is; then
// the given targets.
PinTrack PinsAfter(Backend& backend, const ClothRecord& cloth, const std::vector<Pin>& pins) {
  const ClothRuntime& runtime = *cloth.runtime;
  const double now_s = runtime.now().time_s;
  const auto old_pins = runtime.model()->pins();
  const ClothHandle handle = runtime.handle();
  const StateColumns state = backend.Read({std::span(&handle, 1), true, false});
  std::vector<PinMotion> motions;
  for (const Pin& pin : pins) {
    const auto old = std::lower_bound(old_pins.begin(), old_pins.end(), pin.particle);
    PinMotion motion;
    if (old != old_pins.end() && *old == pin.particle) {
      motion = runtime.pins().motion(static_cast<size_t>(old - old_pins.begin()));
    } else {
      motion.start_m = motion.target_m = Row(state.positions_m, pin.particle);
      motion.start_s = now_s;
    }
    motions.push_back(motion);
  }
  PinTrack track;
  track.Start(std::move(motions));
  for (size_t k = 0; k < pins.size(); ++k) {
    if (!pins[k].target_m.has_value()) continue;
    track.Move(k, cloth.placement.ClothFromEnvironment(*pins[k].target_m), 0, now_s);
  }
  return track;
}

Result<PlannedUpdate> Plan(Backend& backend, const ClothRecord& cloth, const ClothChange& change,
                           const RepinnedModel* repinned) {
  if (!cloth.runtime->is_alive()) return ClothNotFound(cloth.id);
  const auto before = cloth.description();
  Result<ClothParameters> parameters = ApplyChange(before->parameters, change);
  if (!parameters.ok()) return parameters.status();
  PlannedUpdate plan;
  auto after = std::make_shared<ClothDescription>(*before);
  after->parameters = std::move(parameters).value();
  plan.write.parameters = InClothFrame(after->parameters, cloth.placement);
  plan.undo.parameters = InClothFrame(before->parameters, cloth.placement);
  if (repinned != nullptr) {
    after->model_description = repinned->description;
    after->model = repinned->model;
    after->pins = SortedPins(*change.pins);
    after->plan = backend.PlanOf(*after->model);
    const double now_s = cloth.runtime->now().time_s;
    plan.pins = PinsAfter(backend, cloth, after->pins);
    plan.write.model = after->model;
    plan.write.pin_targets_m = PinsNow(*plan.pins, now_s);
    plan.undo.model = before->model;
    plan.undo.pin_targets_m = PinsNow(cloth.runtime->pins(), now_s);
  }
  plan.after = std::move(after);
  return plan;
}

void Commit(ClothRecord& cloth, PlannedUpdate plan) {
  ClothRuntime& runtime = *cloth.runtime;
  runtime.SetTimeStep(plan.after->parameters.settings.time_step_s);
  runtime.SetShift(ShiftOf(*plan.after->model, plan.after->parameters, cloth.placement));
  if (plan.pins.has_value()) {
    runtime.SetModel(plan.after->model);
    runtime.pins() = std::move(*plan.pins);
  }
  cloth.ReplaceDescription(std::move(plan.after));
}

// Field names as in UpdateClothsRequest: "pins[2].particle" -> "spec.pins[2].particle".
Status InSpec(const Status& status) {
  std::vector<FieldViolation> violations = status.violations();
  if (violations.empty()) return status;
  for (FieldViolation& violation : violations) violation.field = "spec." + violation.field;
  return Status::InvalidFields(std::move(violations));
}

}  // namespace

Result<std::vector<RepinnedModel>> BuildRepinnedModels(
    std::span<const std::shared_ptr<ClothRecord>> cloths, const std::vector<Pin>& pins,
    ModelCache& models) {
  std::vector<uint32_t> particles;
  for (const Pin& pin : pins) particles.push_back(pin.particle);
  std::map<std::shared_ptr<const ModelDescription>, RepinnedModel> built;
  std::vector<RepinnedModel> repinned;
  for (const auto& cloth : cloths) {
    const auto old_description = cloth->description()->model_description;
    RepinnedModel& entry = built[old_description];
    if (entry.model == nullptr) {
      auto description = std::make_shared<ModelDescription>(*old_description);
      description->pinned_particles = particles;
      auto model = SceneModel::Build(*description);
      if (!model.ok()) return InSpec(model.status());
      entry = {std::move(description), models.Share(*model)};
    }
    repinned.push_back(entry);
  }
  return repinned;
}

Status UpdateOnDevice(Backend& backend, std::span<const std::shared_ptr<ClothRecord>> cloths,
                      const ClothChange& change, std::span<const RepinnedModel> repinned) {
  std::vector<PlannedUpdate> plans;
  for (size_t k = 0; k < cloths.size(); ++k) {
    Result<PlannedUpdate> plan =
        Plan(backend, *cloths[k], change, repinned.empty() ? nullptr : &repinned[k]);
    if (!plan.ok()) return plan.status();
    plans.push_back(std::move(plan).value());
  }
  for (size_t k = 0; k < cloths.size(); ++k) {
    const Status status = backend.Write(cloths[k]->runtime->handle(), plans[k].write);
    if (status.ok()) continue;
    for (size_t done = 0; done < k; ++done) {
      const Status undone = backend.Write(cloths[done]->runtime->handle(), plans[done].undo);
      // It fitted a moment ago, and the device thread is alone.
      DRAPE_CHECK(undone.ok(), "a change could not be taken back");
    }
    return status;
  }
  for (size_t k = 0; k < cloths.size(); ++k) Commit(*cloths[k], std::move(plans[k]));
  return Status::Ok();
}

}  // namespace drape
