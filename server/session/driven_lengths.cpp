#include "server/session/driven_lengths.h"

namespace drape {

std::vector<CountedCloth> DrivenBy(
    const StepControls& controls, std::span<const std::shared_ptr<ClothRecord>> cloths,
    std::span<const std::shared_ptr<const ClothDescription>> becoming) {
  std::vector<CountedCloth> driven;
  const auto add = [&](uint32_t index) {
    if (!driven.empty() && driven.back().cloth == cloths[index]) return;  // rows of one cloth
    const bool is_another = !becoming.empty() && becoming[index] != nullptr;
    const auto description = is_another ? becoming[index] : cloths[index]->description();
    driven.push_back({cloths[index], description->model->described_constraint_count()});
  };
  for (const auto& row : controls.length_scales) add(row.cloth_index);
  for (const auto& row : controls.lengths) add(row.cloth_index);
  return driven;
}

std::vector<CountedCloth> DrivenBy(std::span<const LoadPair> pairs) {
  std::vector<CountedCloth> driven;
  for (const LoadPair& pair : pairs) {
    if (!pair.from->runtime.lengths.is_driven()) continue;
    driven.push_back({pair.into, pair.from->description->model->described_constraint_count()});
  }
  return driven;
}

}  // namespace drape
