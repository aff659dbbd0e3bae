#include "server/session/cloth_import.h"

#include "server/session/preparation.h"

namespace drape {

Status ImportMaker::Make(Backend& backend, size_t begin, size_t end) {
  for (size_t k = begin; k < end; ++k) DRAPE_RETURN_IF_ERROR(MakeOne(backend, cloths_[k]));
  return Status::Ok();
}

Status ImportMaker::MakeOne(Backend& backend, const SavedCloth& from) {
  const ClothDescription& description = *from.description;
  const ClothParameters on_device =
      OnDevice(*description.model, description.parameters, from.placement);
  // Where it was created: what crossed itself there is known as such.
  const ParticleState start =
      PlaceAtStart(*description.model, from.transform, from.placement, from.start.get());
  DRAPE_ASSIGN_OR_RETURN(ClothHandle handle, backend.Create(description.model, on_device, start));
  made_.push_back(std::make_shared<ClothRecord>(from.placement, from.transform, from.description,
                                                from.start, from.charges));
  ClothRecord& cloth = *made_.back();
  cloth.id = from.id;  // until it gets another one
  cloth.world = from.world;
  if (from.length_charge != nullptr) {
    cloth.held_lengths.Hold(description.model->described_constraint_count(), from.length_charge);
  }
  cloth.held_colliders.Hold(ColliderCountOf(description), from.collider_charge);
  const std::vector<Eigen::Vector3d> pins_m = from.runtime.pins.At(from.runtime.progress.time_s);
  cloth.runtime->Begin(handle, description.model, on_device.settings,
                       ShiftOf(*description.model, description.parameters, from.placement), pins_m,
                       pins_m);
  cloth.runtime->controls().grips().Start(description.parameters.max_grips);
  StartColliders(on_device, *cloth.runtime);
  return LoadOnDevice(backend, cloth, from);
}

SharedParts PrepareImport(std::span<const SavedCloth> cloths, const BackendDescription& backend,
                          Interruption* interruption) {
  Preparation preparation(backend, interruption);
  for (const SavedCloth& cloth : cloths) {
    preparation.Add(cloth.description->model, cloth.description->parameters, cloth.placement);
  }
  return preparation.Take();
}

}  // namespace drape
