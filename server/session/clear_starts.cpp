#include "server/session/clear_starts.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <variant>

#include "server/solver/cloth_start.h"

namespace drape {
namespace {

// Whether colliders have the same poses at the start.
bool StartAlike(const RigidMotion& a, const RigidMotion& b) {
  return a.pivot_m == b.pivot_m && a.position_m == b.position_m && a.rotation == b.rotation;
}

// Compares everything that a start depends on.
bool AreAlike(const ClothCopy& a, const ClothCopy& b) {
  return a.transform == b.transform &&
         a.parameters.gravity_m_per_s2 == b.parameters.gravity_m_per_s2 &&
         a.parameters.thickness_m == b.parameters.thickness_m &&
         a.parameters.colliders == b.parameters.colliders &&
         std::ranges::equal(a.parameters.collider_motions, b.parameters.collider_motions,
                            StartAlike);
}

std::shared_ptr<const ClearStart> FindStartOf(const SceneModel& model, bool may_let_out,
                                              const ClothCopy& copy, Interruption* interruption) {
  const Placement placement{copy.environment_origin_m, OriginInEnvironment(model, copy.transform)};
  const ParticleState described = PlaceAtStart(model, copy.transform, placement);
  ClearStart start = FindClearStart(model, InClothFrame(copy.parameters, placement),
                                    described.positions_m, may_let_out, interruption);
  if (start.clearance == StartClearance::kFree) return nullptr;
  return std::make_shared<const ClearStart>(std::move(start));
}

// Gives the copy a model with the lengths that its start lets out.
Status LetOut(const ModelDescription& description, ClothCopy& copy, Interruption* interruption) {
  if (copy.start == nullptr || copy.start->let_out.empty()) return Status::Ok();
  auto changed = std::make_shared<ModelDescription>(description);
  changed->let_out = copy.start->let_out;
  // Its sizes have been checked.
  constexpr uint32_t kNoLimit = std::numeric_limits<uint32_t>::max();
  DRAPE_ASSIGN_OR_RETURN(copy.model,
                         SceneModel::Build(*changed, {kNoLimit, kNoLimit, kNoLimit}, interruption));
  copy.description = std::move(changed);
  return Status::Ok();
}

}  // namespace

Status FindClearStarts(ClothCreation& creation, Interruption* interruption) {
  const ModelDescription& description = *creation.description;
  const bool may_let_out = std::holds_alternative<TriangleMesh>(description.topology) &&
                           !description.mesh_import.keep_lengths;
  const ClothCopy* before = nullptr;
  uint32_t searches = 0;
  for (ClothCopy& copy : creation.copies) {
    if (!copy.parameters.colliders.empty()) {
      Ask(interruption);
      const bool is_known = before != nullptr && AreAlike(*before, copy);
      if (is_known) {
        copy.start = before->start;
        copy.description = before->description;
        copy.model = before->model;
      } else {
        copy.start = FindStartOf(*creation.model, may_let_out, copy, interruption);
        DRAPE_RETURN_IF_ERROR(LetOut(description, copy, interruption));
      }
      searches += !is_known && copy.start != nullptr;
      if (searches > kMaxCaughtStarts) {
        return {StatusCode::kResourceExhausted, "CAUGHT_STARTS",
                "more than " + std::to_string(kMaxCaughtStarts) +
                    " cloths of the request are caught in colliders, each at a different position: "
                    "place them outside, or make them in several requests"};
      }
    }
    before = &copy;
  }
  return Status::Ok();
}

}  // namespace drape
