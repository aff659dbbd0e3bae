#include "server/session/pin_controls.h"

#include <algorithm>
#include <optional>
#include <string>

#include "server/session/cloth_indices.h"

namespace drape {

Result<std::vector<PinControl>> MapPinControls(
    std::span<const PinControlRow> rows, std::span<const std::shared_ptr<ClothRecord>> cloths) {
  std::vector<PinControl> controls;
  std::vector<FieldViolation> violations;
  if (rows.empty()) return controls;
  const ClothIndices indices(cloths);
  for (size_t r = 0; r < rows.size() && violations.size() < kMaxNamedRows; ++r) {
    const PinControlRow& row = rows[r];
    const std::string row_text = "[" + std::to_string(r) + "]";
    const std::optional<uint32_t> index = indices.Find(row.cloth);
    if (!index) {
      violations.push_back({"pin_controls.cloth_ids" + row_text, "no cloth of this request"});
      continue;
    }
    const ClothRecord& cloth = *cloths[*index];
    const auto description = cloth.description();
    const auto pins = description->model->pins();
    if (!std::binary_search(pins.begin(), pins.end(), row.particle)) {
      violations.push_back({"pin_controls.particles" + row_text,
                            "particle " + std::to_string(row.particle) + " is not pinned"});
      continue;
    }
    controls.push_back(
        {*index, row.particle, cloth.placement.ClothFromEnvironment(row.target_m), row.over_s});
  }
  if (!violations.empty()) return Status::InvalidFields(std::move(violations));
  return controls;
}

}  // namespace drape
