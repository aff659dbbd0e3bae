#include "server/session/pin_controls.h"

#include <algorithm>
#include <string>
#include <unordered_map>

namespace drape {

Result<std::vector<PinControl>> MapPinControls(
    std::span<const PinControlRow> rows, std::span<const std::shared_ptr<ClothRecord>> cloths) {
  // At most this many bad rows are named; the rest would be more of the same.
  constexpr size_t kMaxViolations = 16;
  std::unordered_map<ClothId, uint32_t> indices;
  if (!rows.empty()) {
    for (uint32_t k = 0; k < cloths.size(); ++k) indices.emplace(cloths[k]->id, k);
  }
  std::vector<PinControl> controls;
  std::vector<FieldViolation> violations;
  for (size_t r = 0; r < rows.size() && violations.size() < kMaxViolations; ++r) {
    const PinControlRow& row = rows[r];
    const std::string index = "[" + std::to_string(r) + "]";
    const auto found = indices.find(row.cloth);
    if (found == indices.end()) {
      violations.push_back({"pin_controls.cloth_ids" + index, "no cloth of this request"});
      continue;
    }
    const ClothRecord& cloth = *cloths[found->second];
    const auto description = cloth.description();
    const auto pins = description->model->pins();
    if (!std::binary_search(pins.begin(), pins.end(), row.particle)) {
      violations.push_back({"pin_controls.particles" + index,
                            "particle " + std::to_string(row.particle) + " is not pinned"});
      continue;
    }
    controls.push_back({found->second, row.particle,
                        cloth.placement.ClothFromEnvironment(row.target_m), row.over_s});
  }
  if (!violations.empty()) return Status::InvalidFields(std::move(violations));
  return controls;
}

}  // namespace drape
