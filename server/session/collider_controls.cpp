#include "server/session/collider_controls.h"

#include <spdlog/fmt/fmt.h>

#include <optional>
#include <utility>

#include "server/session/cloth_indices.h"

namespace drape {

Result<std::vector<ColliderControl>> MapColliderControls(
    std::span<const ColliderControlRow> rows,
    std::span<const std::shared_ptr<ClothRecord>> cloths) {
  std::vector<ColliderControl> controls;
  std::vector<FieldViolation> violations;
  if (rows.empty()) return controls;
  const ClothIndices indices(cloths);
  for (size_t r = 0; r < rows.size() && violations.size() < kMaxNamedRows; ++r) {
    const std::optional<uint32_t> index = indices.Find(rows[r].cloth);
    if (!index) {
      violations.push_back(
          {fmt::format("collider_controls.cloth_ids[{}]", r), "no cloth of this request"});
      continue;
    }
    const ClothRecord& cloth = *cloths[*index];
    const size_t count = cloth.description()->parameters.colliders.size();
    if (rows[r].collider >= count) {
      violations.push_back(
          {fmt::format("collider_controls.colliders[{}]", r),
           fmt::format("{} is not below the number of colliders, {}", rows[r].collider, count)});
      continue;
    }
    ColliderControl control{*index, rows[r].collider, rows[r].target, rows[r].over_s};
    control.target.position_m = cloth.placement.ClothFromEnvironment(rows[r].target.position_m);
    controls.push_back(control);
  }
  if (!violations.empty()) return Status::InvalidFields(std::move(violations));
  return controls;
}

}  // namespace drape
