#include "server/session/clear_starts.h"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

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

std::shared_ptr<const ClearStart> FindStartOf(const SceneModel& model, const ClothCopy& copy) {
  const Placement placement{copy.environment_origin_m, OriginInEnvironment(model, copy.transform)};
  const ParticleState described = PlaceAtStart(model, copy.transform, placement);
  ClearStart start =
      FindClearStart(model, InClothFrame(copy.parameters, placement), described.positions_m);
  if (start.clearance == StartClearance::kFree) return nullptr;
  return std::make_shared<const ClearStart>(std::move(start));
}

}  // namespace

Status FindClearStarts(ClothCreation& creation, const std::function<Status()>& stop_reason) {
  const ClothCopy* before = nullptr;
  uint32_t searches = 0;
  for (ClothCopy& copy : creation.copies) {
    if (!copy.parameters.colliders.empty()) {
      DRAPE_RETURN_IF_ERROR(stop_reason());
      const bool is_known = before != nullptr && AreAlike(*before, copy);
      copy.start = is_known ? before->start : FindStartOf(*creation.model, copy);
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
