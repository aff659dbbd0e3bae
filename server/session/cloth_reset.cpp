#include "server/session/cloth_reset.h"

#include <spdlog/fmt/fmt.h>

#include <memory>
#include <unordered_map>
#include <unordered_set>

#include "server/session/cloth_creation.h"
#include "server/session/cloth_update.h"

namespace drape {

Result<std::vector<std::shared_ptr<ClothRecord>>> FindAmong(
    std::span<const ClothId> ids, std::span<const std::shared_ptr<ClothRecord>> cloths,
    const char* path) {
  std::vector<std::shared_ptr<ClothRecord>> found;
  if (ids.empty()) return found;
  std::unordered_map<ClothId, size_t> places;
  for (size_t k = 0; k < cloths.size(); ++k) places.emplace(cloths[k]->id, k);
  std::unordered_set<ClothId> seen;
  for (size_t r = 0; r < ids.size(); ++r) {
    const auto place = places.find(ids[r]);
    const bool is_new = seen.insert(ids[r]).second;
    if (place == places.end() || !is_new) {
      return Status::InvalidField(
          fmt::format("{}.cloth_ids[{}]", path, r),
          is_new ? "no cloth of this request" : fmt::format("{} occurs twice", ids[r].Packed()));
    }
    found.push_back(cloths[place->second]);
  }
  return found;
}

ClothChange OverridesOf(const ClothStarts& starts) {
  ClothChange change;
  change.overrides = starts.overrides;
  return change;
}

Status ResetOnDevice(Backend& backend, std::span<const std::shared_ptr<ClothRecord>> cloths,
                     const ClothStarts& starts) {
  DRAPE_RETURN_IF_ERROR(CheckAlive(cloths));
  if (!starts.overrides.empty()) {
    DRAPE_RETURN_IF_ERROR(
        UpdateOnDevice(backend, {cloths.begin(), cloths.end()}, OverridesOf(starts)));
  }
  for (size_t k = 0; k < cloths.size(); ++k) {
    DRAPE_RETURN_IF_ERROR(ResetCloth(backend, *cloths[k], starts.TransformOf(k)));
  }
  return Status::Ok();
}

Status CheckAlive(std::span<const std::shared_ptr<ClothRecord>> cloths) {
  for (const auto& cloth : cloths) {
    if (!cloth->runtime->is_alive()) return ClothNotFound(cloth->id);
  }
  return Status::Ok();
}

Status WriteOnDevice(Backend& backend, std::span<const std::shared_ptr<ClothRecord>> cloths,
                     std::span<const ParticleState> states) {
  for (size_t k = 0; k < cloths.size(); ++k) {
    if (!cloths[k]->runtime->is_alive()) continue;  // deleted meanwhile
    ClothUpdate update;
    update.state = states[k];
    DRAPE_RETURN_IF_ERROR(backend.Write(cloths[k]->runtime->handle(), update));
    cloths[k]->runtime->Restate();
  }
  return Status::Ok();
}

}  // namespace drape
