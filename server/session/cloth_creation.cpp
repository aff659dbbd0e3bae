#include "server/session/cloth_creation.h"

#include <algorithm>
#include <utility>

#include "server/core/check.h"
#include "server/session/preparation.h"
#include "server/session/sliced_command.h"

namespace drape {
namespace {

std::vector<Eigen::Vector3d> PositionsOfPins(const SceneModel& model, const ParticleState& state) {
  std::vector<Eigen::Vector3d> positions_m;
  for (const uint32_t particle : model.pins()) positions_m.push_back(state.positions_m[particle]);
  return positions_m;
}

}  // namespace

Status ClothNotFound(ClothId id) {
  return {StatusCode::kNotFound, "CLOTH_NOT_FOUND",
          "no cloth " + std::to_string(id.Packed()) + " in this session"};
}

std::vector<Pin> PinsOf(const SceneModel& model, std::vector<Pin> described) {
  std::vector<Pin>& pins = described;
  for (Pin& pin : pins) pin.particle = model.ParticleOf(pin.particle);
  std::ranges::stable_sort(pins, {}, &Pin::particle);
  const auto rest = std::ranges::unique(pins, {}, &Pin::particle);
  pins.erase(rest.begin(), rest.end());
  return pins;
}

ClothMaker::ClothMaker(ClothCreation creation, std::shared_ptr<const SceneModel> model,
                       std::string plan)
    : creation_(std::move(creation)),
      model_(std::move(model)),
      pins_(PinsOf(*model_, creation_.pins)),
      plan_(std::move(plan)) {
  DRAPE_CHECK(std::equal(pins_.begin(), pins_.end(), model_->pins().begin(), model_->pins().end(),
                         [](const Pin& pin, uint32_t p) { return pin.particle == p; }),
              "the pins are those of the model");
}

Status ClothMaker::Make(Backend& backend, size_t begin, size_t end) {
  for (size_t k = begin; k < end; ++k) {
    DRAPE_RETURN_IF_ERROR(MakeOne(backend, creation_.copies[k]));
  }
  return Status::Ok();
}

namespace {

Placement PlacementOf(const SceneModel& model, const ClothCopy& copy) {
  return {copy.environment_origin_m, OriginInEnvironment(model, copy.transform)};
}

}  // namespace

void PrepareCloths(ClothCreation& creation, const BackendDescription& backend,
                   Interruption* interruption) {
  Preparation preparation(backend, interruption);
  for (const ClothCopy& copy : creation.copies) {
    const auto& model = copy.model != nullptr ? copy.model : creation.model;
    preparation.Add(model, copy.parameters, PlacementOf(*model, copy));
  }
  creation.shared_parts = preparation.Take();
}

Status ClothMaker::MakeOne(Backend& backend, const ClothCopy& copy) {
  const auto& model = copy.model != nullptr ? copy.model : model_;
  const auto& described = copy.model != nullptr ? copy.description : creation_.description;
  const Placement placement = PlacementOf(*model, copy);
  const ParticleState state = PlaceAtStart(*model, copy.transform, placement, copy.start.get());
  const ClothParameters on_device = OnDevice(*model, copy.parameters, placement);
  DRAPE_ASSIGN_OR_RETURN(ClothHandle handle, backend.Create(model, on_device, state));
  auto description = std::make_shared<const ClothDescription>(
      ClothDescription{described, model, copy.parameters, pins_, plan_});
  ClothCharges charges{creation_.map_charges,
                       copy.model != nullptr ? copy.model_charge : creation_.model_charge};
  made_.push_back(std::make_shared<ClothRecord>(placement, copy.transform, std::move(description),
                                                copy.start, std::move(charges)));
  made_.back()->world = creation_.world;
  made_.back()->held_colliders.Hold(ColliderCountOf(*made_.back()->description()),
                                    copy.collider_charge);
  const std::vector<Eigen::Vector3d> starts_m = PositionsOfPins(*model, state);
  made_.back()->runtime->Begin(handle, model, on_device.settings,
                               ShiftOf(*model, copy.parameters, placement), starts_m,
                               PinTargets(pins_, placement, starts_m));
  made_.back()->runtime->controls().grips().Start(copy.parameters.max_grips);
  StartColliders(on_device, *made_.back()->runtime);
  return Status::Ok();
}

void FreeCloth(Backend& backend, ClothRecord& cloth) {
  FreeCloth(backend, cloth, ClothNotFound(cloth.id));
}

void FreeCloth(Backend& backend, ClothRecord& cloth, const Status& reason) {
  if (!cloth.runtime->is_alive()) return;
  cloth.runtime->End(reason);
  backend.Destroy(cloth.runtime->handle());
  // Frees the quota before any answer is sent, even if the record is still held.
  cloth.DropCharges();
}

void FreeCloths(Backend& backend, std::span<const std::shared_ptr<ClothRecord>> cloths) {
  for (const auto& cloth : cloths) cloth->runtime->BeginLeaving();
  for (const auto& cloth : cloths) FreeCloth(backend, *cloth);
}

bool FreeInSlices(Scheduler& scheduler, const std::string& owner,
                  std::vector<std::shared_ptr<ClothRecord>> cloths,
                  std::function<void(Backend&)> finish) {
  const auto held =
      std::make_shared<const std::vector<std::shared_ptr<ClothRecord>>>(std::move(cloths));
  const auto slice = [held](Backend& backend, size_t begin, size_t end) {
    FreeCloths(backend, std::span(*held).subspan(begin, end - begin));
    return Status::Ok();
  };
  return CleanUpAsOne(
      scheduler, owner, held->size(), kSliceCloths, slice,
      [finish = std::move(finish)](Backend& backend, const Status&) { finish(backend); });
}

Status ResetCloth(Backend& backend, ClothRecord& cloth, const RigidTransform* transform) {
  const auto description = cloth.description();
  ClothUpdate update;
  update.state = transform != nullptr ? cloth.StateAt(*transform) : cloth.InitialState();
  const std::vector<Eigen::Vector3d> starts_m = PositionsOfPins(*description->model, *update.state);
  update.pin_targets_m = starts_m;
  if (cloth.runtime->controls().lengths().is_driven()) update.rest_lengths_m.emplace();
  const ClothParameters in_cloth_frame = InClothFrame(description->parameters, cloth.placement);
  if (cloth.runtime->controls().colliders().is_moving()) {
    update.collider_motions = in_cloth_frame.collider_motions;
  }
  DRAPE_RETURN_IF_ERROR(backend.Write(cloth.runtime->handle(), update));
  cloth.runtime->Reset(starts_m, PinTargets(description->pins, cloth.placement, starts_m));
  StartColliders(in_cloth_frame, *cloth.runtime);
  return Status::Ok();
}

}  // namespace drape
