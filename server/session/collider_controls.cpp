#include "server/session/collider_controls.h"

#include <spdlog/fmt/fmt.h>

#include <unordered_map>
#include <utility>

namespace drape {

Result<std::vector<ColliderControl>> MapColliderControls(
    std::span<const ColliderControlRow> rows,
    std::span<const std::shared_ptr<ClothRecord>> cloths) {
  // At most this many bad rows are named; the rest would be more of the same.
  constexpr size_t kMaxViolations = 16;
  std::vector<ColliderControl> controls;
  std::vector<FieldViolation> violations;
  std::unordered_map<ClothId, uint32_t> indices;
  if (!rows.empty()) {
    for (uint32_t k = 0; k < cloths.size(); ++k) indices.emplace(cloths[k]->id, k);
  }
  for (size_t r = 0; r < rows.size() && violations.size() < kMaxViolations; ++r) {
    const auto found = indices.find(rows[r].cloth);
    if (found == indices.end()) {
      violations.push_back(
          {fmt::format("collider_controls.cloth_ids[{}]", r), "no cloth of this request"});
      continue;
    }
    const ClothRecord& cloth = *cloths[found->second];
    const size_t count = cloth.description()->parameters.colliders.size();
    if (rows[r].collider >= count) {
      violations.push_back(
          {fmt::format("collider_controls.colliders[{}]", r),
           fmt::format("{} is not below the number of colliders, {}", rows[r].collider, count)});
      continue;
    }
    ColliderControl control{found->second, rows[r].collider, rows[r].target, rows[r].over_s};
    control.target.position_m = cloth.placement.ClothFromEnvironment(rows[r].target.position_m);
    controls.push_back(control);
  }
  if (!violations.empty()) return Status::InvalidFields(std::move(violations));
  return controls;
}

}  // namespace drape
