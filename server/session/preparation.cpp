#include "server/session/preparation.h"

#include "server/solver/collider_contact.h"

namespace drape {

PartsKind KindOf(const SceneModel& model, const ClothParameters& parameters) {
  return {&model, parameters.self_collision.has_value(), HasSurfaceContacts(model, parameters),
          parameters.is_in_world};
}

void Preparation::Add(const std::shared_ptr<const SceneModel>& model,
                      const ClothParameters& parameters, const Placement& placement) {
  const bool is_new = kinds_.insert(KindOf(*model, parameters)).second;
  const bool is_among_first = added_++ < kMaxOfOneKind;
  if (!is_new && !is_among_first) return;
  Ask(interruption_);
  const ClothParameters on_device = OnDevice(*model, parameters, placement);
  if (backend_.prepare) backend_.prepare(*model, on_device);
  if (backend_.make_shared_parts) {
    made_.push_back(backend_.make_shared_parts(model, on_device, interruption_));
  }
}

bool MayNeedParts(std::span<const std::shared_ptr<ClothRecord>> cloths, const ClothChange& change) {
  if (!change.self_collision && !change.colliders && !change.settings) return false;
  if (cloths.size() > Preparation::kMaxOfOneKind) return true;
  for (size_t k = 0; k < cloths.size(); ++k) {
    const auto before = cloths[k]->description();
    const Result<ClothParameters> after = ApplyChange(before->parameters, change, k);
    if (!after.ok()) continue;  // the update says so
    if (after->self_collision && !before->parameters.self_collision) return true;
    const SceneModel& model = *before->model;
    if (HasSurfaceContacts(model, *after) && !HasSurfaceContacts(model, before->parameters)) {
      return true;
    }
  }
  return false;
}

}  // namespace drape
