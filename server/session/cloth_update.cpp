#include "server/session/cloth_update.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <optional>
#include <string>
#include <unordered_set>
#include <utility>

#include "server/session/cloth_creation.h"
#include "server/session/cloth_reset.h"
#include "server/session/preparation.h"

namespace drape {

// The change of one cloth, complete before anything is changed. All cloths of an update have theirs
// until Commit: what can be made again is not kept.
struct PlannedUpdate {
  std::shared_ptr<const ClothDescription> after;
  ClothCharges charges;                // of `after`
  StepSettings settings;               // of the device
  std::optional<PinTrack> pins;        // if they are replaced
  LengthTrack lengths;                 // for another model
  std::unique_ptr<ClothUpdate> write;  // until the device has it
  bool has_new_model = false;
  bool has_new_colliders = false;
};

namespace {

// Suggested delay for a client whose update met too many others [ms].
constexpr int64_t kConflictRetry_ms = 50;

// Positions of a cloth: rows of a column from `first_row` on.
struct PositionRows {
  const ScalarColumn& positions_m;
  size_t first_row = 0;
};

// The new pins: remaining ones keep their motions, new ones start at their particle; then the given
// targets are applied.
PinTrack PinsAfter(const PositionRows& rows, const ClothRecord& cloth,
                   const std::vector<Pin>& pins) {
  const ClothRuntime& runtime = *cloth.runtime;
  const double now_s = runtime.now().time_s;
  const auto old_pins = runtime.model()->pins();
  std::vector<Motion<Eigen::Vector3d>> motions;
  for (const Pin& pin : pins) {
    const auto old = std::lower_bound(old_pins.begin(), old_pins.end(), pin.particle);
    if (old != old_pins.end() && *old == pin.particle) {
      const auto k = static_cast<size_t>(old - old_pins.begin());
      motions.push_back(runtime.controls().pins().motion(k));
    } else {
      const Eigen::Vector3d here_m = VectorAt(rows.positions_m, rows.first_row + pin.particle);
      motions.push_back({here_m, here_m, now_s, 0});
    }
  }
  PinTrack track;
  track.Start(std::move(motions), false);
  for (size_t k = 0; k < pins.size(); ++k) {
    if (!pins[k].target_m.has_value()) continue;
    track.Move(k, cloth.placement.ClothFromEnvironment(*pins[k].target_m), 0, now_s);
  }
  return track;
}

// Driven lengths continue with another model, unless it has other constraints.
void PlanLengths(const ClothRuntime& runtime, const ClothChange& change, const SceneModel& model,
                 PlannedUpdate& plan) {
  const LengthTrack& lengths = runtime.controls().lengths();
  if (!lengths.is_driven()) return;
  if (change.model.distance_constraints) return;
  plan.lengths = lengths.CarriedTo(model);
  if (!plan.lengths.is_driven()) return;
  plan.write->rest_lengths_m = plan.lengths.LengthsAt(runtime.now().time_s);
}

// Whether the change may be made to the cloth as it is now.
Status CheckStillFits(const ClothRecord& cloth, const ClothDescription& before,
                      const ChangedModel* changed, const ModelRules& rules) {
  if (changed != nullptr && changed->before != before.model_description) {
    Status status(StatusCode::kAborted, kUpdateConflict,
                  "another update changed cloth " + std::to_string(cloth.id.Packed()) +
                      " at the same time; nothing has been changed");
    return status.RetryAfterMs(kConflictRetry_ms);
  }
  if (!rules.accept) return Status::Ok();
  return rules.accept(before, changed != nullptr ? *changed->model : *before.model);
}

// The cloth is alive, and the `index`th of the update. `changed` is null unless it gets another
// model; `rows` hold its positions if it gets other pins.
Result<PlannedUpdate> PlanFor(const ClothRecord& cloth, const ClothChange& change, size_t index,
                              const ChangedModel* changed, const PositionRows& rows,
                              const BackendDescription& backend, const ModelRules& rules) {
  const auto before = cloth.description();
  DRAPE_RETURN_IF_ERROR(CheckStillFits(cloth, *before, changed, rules));
  DRAPE_ASSIGN_OR_RETURN(ClothParameters parameters,
                         ApplyChange(before->parameters, change, index));
  PlannedUpdate plan;
  plan.write = std::make_unique<ClothUpdate>();
  ClothUpdate& write = *plan.write;
  auto after = std::make_shared<ClothDescription>(*before);
  after->parameters = std::move(parameters);
  plan.charges = cloth.charges();
  if (change.colliders) plan.charges.maps = change.map_charges;
  const SceneModel& model = changed != nullptr ? *changed->model : *before->model;
  write.parameters = OnDevice(model, after->parameters, cloth.placement);
  plan.settings = write.parameters->settings;
  plan.has_new_colliders = change.colliders.has_value();
  const ClothControls& controls = cloth.runtime->controls();
  const double now_s = cloth.runtime->now().time_s;
  if (controls.colliders().is_moving() && !plan.has_new_colliders) {
    write.collider_motions = controls.colliders().At(now_s);
  }
  if (changed != nullptr) {
    after->model_description = changed->description;
    after->model = changed->model;
    plan.charges.model = changed->charge;
    plan.has_new_model = true;
    write.model = after->model;
    PlanLengths(*cloth.runtime, change, *after->model, plan);
  } else if (controls.lengths().is_driven()) {  // another backend may have to know them
    write.rest_lengths_m = controls.lengths().LengthsAt(now_s);
  }
  after->plan = backend.plan_of(*after->model, after->parameters);
  if (change.pins) {
    after->pins = PinsOf(model, *change.pins);
    plan.pins = PinsAfter(rows, cloth, after->pins);
    write.pin_targets_m = plan.pins->At(now_s);
  }
  plan.after = std::move(after);
  return plan;
}

// What the device must be told where it has got the plan, which has not been committed.
ClothUpdate UndoOf(const ClothRecord& cloth, const PlannedUpdate& plan) {
  const auto before = cloth.description();
  const ClothControls& controls = cloth.runtime->controls();
  const double now_s = cloth.runtime->now().time_s;
  ClothUpdate undo;
  if (plan.has_new_model) undo.model = before->model;
  undo.parameters = OnDevice(*before->model, before->parameters, cloth.placement);
  if (controls.colliders().is_moving()) undo.collider_motions = controls.colliders().At(now_s);
  if (controls.lengths().is_driven()) undo.rest_lengths_m = controls.lengths().LengthsAt(now_s);
  if (plan.pins) undo.pin_targets_m = controls.pins().At(now_s);
  return undo;
}

void CommitTo(ClothRecord& cloth, PlannedUpdate plan) {
  ClothRuntime& runtime = *cloth.runtime;
  runtime.SetSettings(plan.settings);
  runtime.SetShift(ShiftOf(*plan.after->model, plan.after->parameters, cloth.placement));
  ClothControls& controls = runtime.controls();
  if (plan.has_new_model) controls.lengths() = std::move(plan.lengths);
  runtime.SetModel(plan.after->model);
  controls.grips().ReleasePins(*plan.after->model);
  if (plan.has_new_colliders) {
    StartColliders(InClothFrame(plan.after->parameters, cloth.placement), runtime);
  }
  if (plan.pins.has_value()) controls.pins() = std::move(*plan.pins);
  cloth.ReplaceDescription(std::move(plan.after), std::move(plan.charges));
}

// Other settings are for all cloths of a world.
Status CheckWholeWorlds(std::span<const std::shared_ptr<ClothRecord>> cloths,
                        const ClothChange& change) {
  if (!change.settings) return Status::Ok();
  std::unordered_set<const ClothRuntime*> named;  // of worlds
  for (const auto& cloth : cloths) {
    if (cloth->runtime->world() != nullptr) named.insert(cloth->runtime.get());
  }
  std::unordered_set<const ClothWorld*> seen;
  for (const auto& cloth : cloths) {
    const std::shared_ptr<ClothWorld>& world = cloth->runtime->world();
    if (world == nullptr || !seen.insert(world.get()).second) continue;
    for (const ClothWorld::Member& member : world->members()) {
      if (named.contains(member.cloth)) continue;
      return Status::InvalidField(
          "spec.settings", "all cloths of a world have the same settings: also name cloth " +
                               std::to_string(member.id) + ", which is in the world of cloth " +
                               std::to_string(cloth->id.Packed()));
    }
  }
  return Status::Ok();
}

}  // namespace

SharedParts PrepareUpdate(std::span<const std::shared_ptr<ClothRecord>> cloths,
                          const ClothChange& change, std::span<const ChangedModel> models,
                          const BackendDescription& backend, Interruption* interruption) {
  Preparation preparation(backend, interruption);
  for (size_t k = 0; k < cloths.size(); ++k) {
    const auto before = cloths[k]->description();
    const Result<ClothParameters> after = ApplyChange(before->parameters, change, k);
    if (!after.ok()) break;  // UpdateOnDevice says so
    const auto& model = models.empty() ? before->model : models[k].model;
    preparation.Add(model, *after, cloths[k]->placement);
  }
  return preparation.Take();
}

ClothUpdater::ClothUpdater(std::vector<std::shared_ptr<ClothRecord>> cloths, ClothChange change,
                           std::vector<ChangedModel> models, ModelRules rules)
    : cloths_(std::move(cloths)),
      change_(std::move(change)),
      models_(std::move(models)),
      rules_(std::move(rules)) {}

ClothUpdater::~ClothUpdater() = default;

Status ClothUpdater::Begin() const {
  DRAPE_RETURN_IF_ERROR(CheckAlive(cloths_));
  return CheckWholeWorlds(cloths_, change_);
}

Status ClothUpdater::Write(Backend& backend, size_t begin, size_t end) {
  StateColumns state;
  if (change_.pins) {
    std::vector<ClothHandle> handles;
    for (size_t k = begin; k < end; ++k) handles.push_back(cloths_[k]->runtime->handle());
    state = backend.Read({handles, true, false});
  }
  const BackendDescription description = backend.Describe();
  PositionRows rows{state.positions_m};
  for (size_t k = begin; k < end; ++k) {
    DRAPE_ASSIGN_OR_RETURN(PlannedUpdate plan,
                           PlanFor(*cloths_[k], change_, k, models_.empty() ? nullptr : &models_[k],
                                   rows, description, rules_));
    plans_.push_back(std::make_unique<PlannedUpdate>(std::move(plan)));
    rows.first_row += cloths_[k]->runtime->particle_count();
  }
  for (; written_ < end; ++written_) {
    const ClothHandle handle = cloths_[written_]->runtime->handle();
    const std::unique_ptr<ClothUpdate> write = std::move(plans_[written_]->write);
    DRAPE_RETURN_IF_ERROR(backend.Write(handle, *write));
  }
  return Status::Ok();
}

void ClothUpdater::Commit(size_t begin, size_t end) {
  for (size_t k = begin; k < end; ++k) {
    CommitTo(*cloths_[k], std::move(*plans_[k]));
    plans_[k] = nullptr;
  }
}

void ClothUpdater::TakeBack(Backend& backend, size_t count) {
  plans_.resize(written_);
  for (const size_t until = written_ - count; written_ > until; plans_.pop_back()) {
    ClothRecord& cloth = *cloths_[--written_];
    const Status undone = backend.Write(cloth.runtime->handle(), UndoOf(cloth, *plans_.back()));
    if (undone.ok()) continue;
    spdlog::error("cloth_ended cloth={} reason=update_not_undone status=\"{}\"", cloth.id.Packed(),
                  undone.ToString());
    FreeCloth(backend, cloth,
              Status(StatusCode::kResourceExhausted, "DEVICE_MEMORY",
                     "cloth " + std::to_string(cloth.id.Packed()) +
                         " was deleted: the device had no room to undo a change of it"));
    ++ended_;
  }
}

Status ClothUpdater::Error(const Status& status) const {
  if (ended_ == 0) return status;
  return Status(status.code(), status.reason(),
                status.message() + "; " + std::to_string(ended_) +
                    " of the cloths were deleted: there was no room to undo the change");
}

Status UpdateOnDevice(Backend& backend, std::vector<std::shared_ptr<ClothRecord>> cloths,
                      const ClothChange& change) {
  ClothUpdater updater(std::move(cloths), change);
  const size_t count = updater.cloths().size();
  DRAPE_RETURN_IF_ERROR(updater.Begin());
  const Status status = updater.Write(backend, 0, count);
  if (!status.ok()) {
    updater.TakeBack(backend, updater.written());
    return updater.Error(status);
  }
  updater.Commit(0, count);
  return Status::Ok();
}

}  // namespace drape
