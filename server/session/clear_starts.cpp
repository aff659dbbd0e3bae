#include "server/session/clear_starts.h"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <variant>

#include "server/solver/cloth_start.h"

namespace drape {
namespace {

bool IsSame(const RigidTransform& a, const RigidTransform& b) {
  return a.position_m == b.position_m && a.rotation.coeffs() == b.rotation.coeffs();
}
bool IsSame(const SphereCollider& a, const SphereCollider& b) {
  return a.center_m == b.center_m && a.radius_m == b.radius_m;
}
bool IsSame(const PlaneCollider& a, const PlaneCollider& b) {
  return a.point_m == b.point_m && a.normal == b.normal;
}
bool IsSame(const CapsuleCollider& a, const CapsuleCollider& b) {
  return a.a_m == b.a_m && a.b_m == b.b_m && a.radius_m == b.radius_m;
}
bool IsSame(const BoxCollider& a, const BoxCollider& b) {
  return a.center_m == b.center_m && a.half_extents_m == b.half_extents_m &&
         a.rotation.coeffs() == b.rotation.coeffs();
}
bool IsSame(const DistanceMapCollider& a, const DistanceMapCollider& b) {
  return a.map == b.map && IsSame(a.transform, b.transform);
}
bool IsSame(const Collider& a, const Collider& b) {
  return a.index() == b.index() && std::visit(
                                       [&](const auto& shape) {
                                         using Shape = std::decay_t<decltype(shape)>;
                                         return IsSame(shape, std::get<Shape>(b));
                                       },
                                       a);
}
// The collider's position at the start.
bool IsSame(const RigidMotion& a, const RigidMotion& b) {
  return a.pivot_m == b.pivot_m && a.position_m == b.position_m &&
         a.rotation.coeffs() == b.rotation.coeffs();
}

template <class Item>
bool AreSame(const std::vector<Item>& a, const std::vector<Item>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Item& one, const Item& other) { return IsSame(one, other); });
}

// Compares everything that a start depends on.
bool AreAlike(const ClothCopy& a, const ClothCopy& b) {
  return IsSame(a.transform, b.transform) &&
         a.parameters.gravity_m_per_s2 == b.parameters.gravity_m_per_s2 &&
         a.parameters.thickness_m == b.parameters.thickness_m &&
         AreSame(a.parameters.colliders, b.parameters.colliders) &&
         AreSame(a.parameters.collider_motions, b.parameters.collider_motions);
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
